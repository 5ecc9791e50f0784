// The identifiers of traces and spans, and their text in messages between processes: the header `traceparent`
// of W3C Trace Context (https://www.w3.org/TR/trace-context/, version 00).
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

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
std::string hex(const TraceId& id);  // 32 lower-case digits
std::string hex(const SpanId& id);   // 16 lower-case digits

// Identifies a span to other processes, which record its children. Plain data without allocations.
struct SpanContext {
  TraceId trace;
  SpanId span;
  bool sampled = true;  // false: spans of this trace are not recorded
  auto operator<=>(const SpanContext&) const = default;
};

// Returns the text "00-TRACE-SPAN-FLAGS", 55 characters.
std::string to_traceparent(const SpanContext& context);
// Parses such a text; nullopt: it is not valid. Of the texts of later versions only the fields of version 00
// are read.
std::optional<SpanContext> parse_traceparent(std::string_view text);

// The same text always gives the same id, so that a process continues its trace after a restart. Texts must
// be unique: the ids are parts of their SHA-256.
TraceId trace_id_of(std::string_view text);
SpanId span_id_of(const TraceId& trace, std::string_view text);

}  // namespace ls::trace
