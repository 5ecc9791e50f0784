// `submit` of an archive: it is sent unchanged, with the options in the query.
#pragma once

#include <optional>
#include <string>

#include "common/job/settings.h"

namespace ls::cli {

// "application/zip" or "application/x-tar" by the file's name (.zip, .tar, .tar.gz, .tgz); nullopt: it is a
// scene.
std::optional<std::string> bundle_type(const std::string& file);

// The spec as query parameters: "?spp=8&define=a%3D1", or empty. Options that were not given are omitted,
// because the bundle may set them; `with_priority`: the priority was given.
std::string spec_query(const JobSpec& spec, bool with_priority);

}  // namespace ls::cli
