// Requests and answers of OTLP over HTTP in JSON (https://opentelemetry.io/docs/specs/otlp/): the body of an
// ExportTraceServiceRequest, and the number of rejected spans in its answer.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/trace/span.h"

namespace ls::trace {

// Returns the body of a request. Bytes that are not UTF-8 are replaced.
std::string otlp_request(const Resource& resource, std::span<const Span> spans);

struct PartialSuccess {
  std::uint64_t rejected = 0;  // number of spans
  std::string message;         // for the operator, of at most 200 characters; empty: none
};
// Reads the body of an answer of status 2xx. If it cannot be parsed, this counts as full success: it may be
// empty or in another encoding.
PartialSuccess otlp_partial_success(std::string_view answer);

}  // namespace ls::trace
