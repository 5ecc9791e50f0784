// Reads a file of glTF 2.0 and translates it to a Document in Mitsuba's format, the common form of all
// readers.
#pragma once

#include <string>
#include <string_view>

#include "common/scene/xml/document.h"

namespace ls::scene::gltf {

bool is_gltf(std::string_view file_name);  // by its ending, .gltf or .glb
std::string too_large(std::size_t bytes);  // message for a file that is too large

// nullopt: the file cannot be read, which has been reported.
std::optional<Document> load_document(std::string_view file_name, std::string_view text, AssetSource& assets,
                                      const ReadOptions& options, Report& report);

}  // namespace ls::scene::gltf
