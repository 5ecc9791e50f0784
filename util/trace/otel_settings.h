// Settings of tracing: to which collector (the server for traces) spans are sent, and which traces are
// recorded. The operator sets both in OpenTelemetry's standard environment variables
// (https://opentelemetry.io/docs/specs/otel/configuration/sdk-environment-variables/).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "util/trace/span.h"

namespace ls::trace {

// Decides which traces are recorded. Unless another program's decision is kept, the decision depends only on
// the trace id and `ratio`, so that all processes decide alike.
struct Sampler {
  double ratio = 1;            // fraction of the traces that are recorded, 0 to 1
  bool parent_decides = true;  // true: if another program began the trace, that program's decision is kept

  bool takes(const TraceId& trace, std::optional<bool> parent_sampled) const;
};

struct Settings {
  std::string url;  // where POST requests with spans are sent
  std::vector<std::pair<std::string, std::string>> headers;
  std::string ca_file;  // file with the trusted CA certificates; empty: those of the system
  double seconds = 10;  // time limit from sending a request to having received its answer
  // The service name: OTEL_SERVICE_NAME or, if it is not set, the attribute service.name in
  // OTEL_RESOURCE_ATTRIBUTES or, without one, the name of the program.
  std::string service;
  std::vector<std::pair<std::string, std::string>> resource;  // OTEL_RESOURCE_ATTRIBUTES without service.name
  Sampler sampler;
};

// Returns the value of an environment variable; nullptr if it is not set.
using Environment = std::function<const char*(const char* name)>;

// Reads OTEL_SDK_DISABLED, OTEL_TRACES_EXPORTER, OTEL_SERVICE_NAME, OTEL_RESOURCE_ATTRIBUTES,
// OTEL_TRACES_SAMPLER and OTEL_TRACES_SAMPLER_ARG, and OTEL_EXPORTER_OTLP_ENDPOINT, ..._HEADERS, ..._TIMEOUT,
// ..._CERTIFICATE and ..._PROTOCOL. Each OTEL_EXPORTER_OTLP_... is overridden by
// OTEL_EXPORTER_OTLP_TRACES_... nullopt: nothing is traced, for example because no endpoint is set. Error
// invalid_argument: a variable has an invalid value. The message names the variable, but does not contain the
// value of a header. Spans are always sent as JSON: if the protocol is http/protobuf, a warning is logged;
// any protocol other than http/json and http/protobuf is an error.
Result<std::optional<Settings>> settings_from(const Environment& environment, const std::string& program);

}  // namespace ls::trace
