// `submit` of an archive: it is sent as it is, and the options go into the query.
#pragma once

#include <optional>
#include <string>

#include "common/job/settings.h"

namespace ls::cli {

// "application/zip" or "application/x-tar" by the file's name (.zip, .tar, .tar.gz, .tgz); nothing: it is a
// scene.
std::optional<std::string> bundle_type(const std::string& file);

// "?spp=8&define=a%3D1", or nothing at all: the spec as query parameters. What was not asked for is left out,
// as the bundle may have a word on it; `with_priority` tells whether that was asked for.
std::string spec_query(const JobSpec& spec, bool with_priority);

}  // namespace ls::cli
