// Reads a file of glTF 2.0 and translates it to a Document, a tree of elements in Mitsuba's format. Files of
// all other scene formats become such a tree, too.
#pragma once

#include <string>
#include <string_view>

#include "formats/xml/document.h"

namespace ls::scene::gltf {

bool is_gltf(std::string_view file_name);  // true if the name ends in .gltf or .glb
// Returns the error message for a file of `bytes` bytes, which is too large.
std::string too_large(std::size_t bytes);

// Translates the text (content) of a file. nullopt: the file cannot be read; the reason is in `report`.
std::optional<Document> load_document(std::string_view file_name, std::string_view text, AssetSource& assets,
                                      const ReadOptions& options, Report& report);

}  // namespace ls::scene::gltf
