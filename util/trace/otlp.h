// Requests and answers of OTLP over HTTP in JSON (https://opentelemetry.io/docs/specs/otlp/): the body of an
// ExportTraceServiceRequest, and the number of rejected spans in its answer.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "util/trace/span.h"

namespace ls::trace {

// Returns the body of a request. Bytes that are not UTF-8 are replaced.
std::string otlp_request(const Resource& resource, std::span<const Span> spans);

struct PartialSuccess {
  std::uint64_t rejected = 0;  // number of spans of the request that the collector did not accept
  std::string message;         // the collector's message to the operator, cut at 200 bytes; empty: none
};
// Reads the body of an answer of status 2xx. A body that cannot be parsed counts as full success, since the
// body may be empty or in another encoding.
PartialSuccess otlp_partial_success(std::string_view answer);

}  // namespace ls::trace
