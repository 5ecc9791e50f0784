// A span: a named time interval of one job, with attributes. Times are nanoseconds since 1970 (UTC).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/trace/context.h"

namespace ls::trace {

// Keys are literals. Values must not contain tokens or users' file paths.
using Value = std::variant<std::string, std::int64_t, double, bool>;
using Attributes = std::vector<std::pair<const char*, Value>>;

struct SpanEvent {
  std::int64_t at_ns = 0;
  std::string name;
};

enum class SpanKind { internal = 1, client = 3 };  // the numbers of OTLP

struct Span {
  SpanContext context;
  std::optional<SpanId> parent;  // nullopt: the first span of its trace
  const char* name = "";
  SpanKind kind = SpanKind::internal;
  std::int64_t start_ns = 0, end_ns = 0;
  Attributes attributes = {};
  std::vector<SpanEvent> events = {};
  std::uint32_t events_left_out = 0;
  bool failed = false;
};

// Identifies the program that recorded the spans of a trace.
struct Resource {
  std::vector<std::pair<std::string, std::string>> attributes;
};

}  // namespace ls::trace
