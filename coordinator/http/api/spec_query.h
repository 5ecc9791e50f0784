// A job's spec as query parameters: spp=64&size=320x240&define=NAME=VALUE&aov=a,b (POST /api/v1/jobs,
// application/xml).
#pragma once

#include "common/base/error.h"
#include "common/job/settings.h"
#include "coordinator/http/message/message.h"

namespace ls::http {

// Keys: spp, target_error, time, seed, size, integrator, priority, float, aov and tags (comma lists), define
// (repeated). Keys in `also` are ignored; any other key, a repeated one, or a wrong value is an error that
// names it. Defaults come from `base`, the JSON of a spec; `define` is merged name by name.
Result<JobSpec> spec_from_query(const Fields& query, std::string_view also, const std::string& base = "{}");

}  // namespace ls::http
