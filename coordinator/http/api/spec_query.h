// Reads a job's spec (what its submitter asks for: samples, size, seed, ...) from query parameters, as in
// POST /api/v1/jobs?spp=64&size=320x240&define=NAME=VALUE&aov=a,b with an application/xml body.
#pragma once

#include "common/base/error.h"
#include "common/job/settings.h"
#include "coordinator/http/message/message.h"

namespace ls::http {

// Keys: spp, target_error, time, seed, size, integrator, priority, float, frames, max_workers, max_units,
// memory, reference, aov and tags (comma lists), define (may be repeated). The key `also` is ignored; any
// other key, a repeated key, or a wrong value is an error that names the key. Keys that the query lacks keep
// their values in `base`, the JSON of a spec. The query's definitions are added to those of `base`; for a
// name in both the query's value holds.
Result<JobSpec> spec_from_query(const Fields& query, std::string_view also, const std::string& base = "{}");

}  // namespace ls::http
