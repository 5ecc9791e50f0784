// Reads a "uri" of a glTF file: the name of a file beside it, or a data URI, which contains the bytes.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/scene/gltf/value.h"

namespace ls::scene::gltf {

struct Uri {
  bool is_data = false;
  std::string text;  // the bytes of a data URI; otherwise the name of the file
};

// nullopt: the text is neither, which has been reported.
std::optional<Uri> read_uri(const Item& uri);

}  // namespace ls::scene::gltf
