#include "util/trace/span.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/digest.h"

namespace ls::trace {
namespace {

constexpr std::size_t kTraceparent = 55;  // length of a `traceparent` of version 00, in characters
constexpr std::uint8_t kSampledFlag = 1;

template <class Id>
Id first_bytes(const Digest& digest) {
  Id id;
  std::copy_n(digest.bytes.begin(), id.bytes.size(), id.bytes.begin());
  return id;
}

}  // namespace

std::string hex(const TraceId& id) { return to_hex(id.bytes); }
std::string hex(const SpanId& id) { return to_hex(id.bytes); }

std::string to_traceparent(const SpanContext& context) {
  return fmt::format("00-{}-{}-{:02x}", hex(context.trace), hex(context.span),
                     context.sampled ? kSampledFlag : 0);
}

std::optional<SpanContext> parse_traceparent(std::string_view text) {
  if (text.size() < kTraceparent || text[2] != '-' || text[35] != '-' || text[52] != '-') return std::nullopt;
  std::array<std::uint8_t, 1> version{}, flags{};
  SpanContext context;
  if (!read_hex(text.substr(0, 2), version) || !read_hex(text.substr(3, 32), context.trace.bytes) ||
      !read_hex(text.substr(36, 16), context.span.bytes) || !read_hex(text.substr(53, 2), flags))
    return std::nullopt;
  const bool later = version[0] > 0 && text.size() > kTraceparent && text[kTraceparent] == '-';
  if (version[0] == 0xff || (text.size() != kTraceparent && !later)) return std::nullopt;
  if (context.trace == TraceId{} || context.span == SpanId{}) return std::nullopt;
  context.sampled = (flags[0] & kSampledFlag) != 0;
  return context;
}

TraceId trace_id_of(std::string_view text) { return first_bytes<TraceId>(sha256(text)); }

SpanId span_id_of(const TraceId& trace, std::string_view text) {
  return first_bytes<SpanId>(sha256(fmt::format("{} {}", hex(trace), text)));
}

}  // namespace ls::trace
