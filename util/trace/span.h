// Spans: named time intervals of one job, with attributes; the identifiers of traces and spans, and how
// messages between processes carry them: in the header `traceparent` of W3C Trace Context
// (https://www.w3.org/TR/trace-context/, version 00).
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace ls::trace {

// An id whose bytes are all 0 means no id; `traceparent` does not allow it.
struct TraceId {
  std::array<std::uint8_t, 16> bytes{};
  auto operator<=>(const TraceId&) const = default;
};
struct SpanId {
  std::array<std::uint8_t, 8> bytes{};
  auto operator<=>(const SpanId&) const = default;
};
std::string hex(const TraceId& id);  // returns 32 lower-case digits
std::string hex(const SpanId& id);   // returns 16 lower-case digits

// Identifies a span to other processes, so that they can record its child spans. Plain data without
// allocations.
struct SpanContext {
  TraceId trace;
  SpanId span;
  bool sampled = true;  // false: spans of this trace are not recorded
  auto operator<=>(const SpanContext&) const = default;
};

// Returns the text "00-TRACE-SPAN-FLAGS", 55 characters.
std::string to_traceparent(const SpanContext& context);
// Parses a text that to_traceparent() or another program has written; nullopt: it is not valid. If its
// version is later than 00, only the fields of version 00 are read.
std::optional<SpanContext> parse_traceparent(std::string_view text);

// Both return an id that is computed from the text (the first bytes of a SHA-256), so that a restarted
// process gets the same ids again and continues its trace. Different traces, and different spans of a trace,
// must have different texts.
TraceId trace_id_of(std::string_view text);
SpanId span_id_of(const TraceId& trace, std::string_view text);

// The attributes of a span: pairs of key and value. Keys are string literals. Values must not contain access
// tokens or users' file paths, since they are sent to the collector.
using Value = std::variant<std::string, std::int64_t, double, bool>;
using Attributes = std::vector<std::pair<const char*, Value>>;

struct SpanEvent {
  std::int64_t at_ns = 0;
  std::string name;
};

enum class SpanKind { internal = 1, client = 3 };  // the numbers are OTLP's

// Times are nanoseconds since 1970 (UTC).
struct Span {
  SpanContext context;
  std::optional<SpanId> parent;  // the span that this one is part of; nullopt: this is the trace's first span
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
