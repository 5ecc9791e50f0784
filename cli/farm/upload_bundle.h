// `submit` of an archive (a scene with its files): the archive is sent unchanged, with the options in the
// query of the request.
#pragma once

#include <optional>
#include <string>

#include "common/job/settings.h"

namespace ls::cli {

// Returns "application/zip" or "application/x-tar" according to the file's name (.zip, .tar, .tar.gz, .tgz);
// nullopt: the file is a scene, not an archive.
std::optional<std::string> bundle_type(const std::string& file);

// Returns the spec as query parameters, such as "?spp=8&define=a%3D1", or an empty text. Options that were
// not given are omitted, because the archive may set them. A priority has no such absent value:
// `with_priority` says whether it was given.
std::string spec_query(const JobSpec& spec, bool with_priority);

}  // namespace ls::cli
