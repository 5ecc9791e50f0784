// What a "uri" of a glTF file names: a file beside it, or bytes that stand in the text.
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

// nullopt: it is neither, which has been reported.
std::optional<Uri> read_uri(const Item& uri);

}  // namespace ls::scene::gltf
