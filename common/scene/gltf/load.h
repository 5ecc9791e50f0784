// Reads files of glTF 2.0 into a Document of Mitsuba's dialect, as the other readers make one.
#pragma once

#include <string>
#include <string_view>

#include "common/scene/xml/document.h"

namespace ls::scene::gltf {

bool is_gltf(std::string_view file_name);  // by its ending, .gltf or .glb
std::string too_large(std::size_t bytes);  // what to do about a file of so many

// nullopt: the file cannot be read, which has been reported.
std::optional<Document> load_document(std::string_view file_name, std::string_view text, AssetSource& assets,
                                      const ReadOptions& options, Report& report);

}  // namespace ls::scene::gltf
