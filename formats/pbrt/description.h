// Reads a file of pbrt-v4 and translates it to a Document in Mitsuba's format, as is done with files of
// all other scene formats.
#pragma once

#include "formats/xml/document.h"

namespace ls::scene::pbrt {

bool is_pbrt(std::string_view file_name);  // true if the file's name ends in .pbrt

// Returns nullopt if the file cannot be read, which has been reported.
std::optional<Document> load_document(std::string_view file_name, std::string_view text, AssetSource& assets,
                                      const ReadOptions& options, Report& report);

}  // namespace ls::scene::pbrt
