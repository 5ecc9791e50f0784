// Where traces are sent, and which traces are recorded. The operator sets both in OpenTelemetry's standard
// environment variables (https://opentelemetry.io/docs/specs/otel/configuration/sdk-environment-variables/).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "common/trace/span.h"

namespace ls::trace {

// Decides which traces are recorded. The same trace id always gets the same decision, in every process.
struct Sampler {
  double ratio = 1;            // fraction of the traces that are recorded, 0 to 1
  bool parent_decides = true;  // true: if another program began the trace, its decision is kept

  bool takes(const TraceId& trace, std::optional<bool> parent_sampled) const;
};

struct Settings {
  std::string url;  // receives POST requests with spans
  std::vector<std::pair<std::string, std::string>> headers;
  std::string ca_file;  // certificates of authorities; empty: the system's
  double seconds = 10;  // time limit until the answer
  std::string service;  // OTEL_SERVICE_NAME, or service.name of the attributes, or the name of the program
  std::vector<std::pair<std::string, std::string>> resource;  // OTEL_RESOURCE_ATTRIBUTES without service.name
  Sampler sampler;
};

// Returns the value of a variable; null: it is not set
using Environment = std::function<const char*(const char* name)>;

// Reads OTEL_SDK_DISABLED, OTEL_TRACES_EXPORTER, OTEL_SERVICE_NAME, OTEL_RESOURCE_ATTRIBUTES,
// OTEL_TRACES_SAMPLER with _ARG, and OTEL_EXPORTER_OTLP_ENDPOINT, _HEADERS, _TIMEOUT, _CERTIFICATE and
// _PROTOCOL; OTEL_EXPORTER_OTLP_TRACES_... overrides each of the latter. nullopt: nothing is traced, for
// example because no endpoint is set. Error invalid_argument: a variable has an invalid value. The message
// names it, but does not contain the value of a header. Spans are always sent as JSON: the protocol
// http/protobuf is accepted with a warning in the log, others are errors.
Result<std::optional<Settings>> settings_from(const Environment& environment, const std::string& program);

}  // namespace ls::trace
