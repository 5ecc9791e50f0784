#include "coordinator/http/message/uri.h"

#include <fmt/format.h>

#include "coordinator/http/message/limits.h"

namespace ls::http {
namespace {

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// Removes and returns the part of `rest` up to `separator`.
std::string_view take_part(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view part = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  return part;
}

Result<std::vector<std::string>> parse_path(std::string_view path) {
  std::vector<std::string> segments;
  path.remove_prefix(1);
  while (!path.empty()) {
    auto segment = percent_decode(take_part(path, '/'), false);
    if (!segment) return tl::unexpected(segment.error());
    if (segment->find('/') != std::string::npos || segment->find('\0') != std::string::npos)
      return fail(Errc::invalid_argument, "the path hides '/' or NUL in a percent code");
    segments.push_back(std::move(*segment));
    if (path.empty()) break;
  }
  return segments;
}

Result<Fields> parse_query(std::string_view query) {
  Fields fields;
  while (!query.empty()) {
    std::string_view value = take_part(query, '&');
    if (value.empty()) continue;
    const std::string_view name = take_part(value, '=');
    if (fields.size() == kMaxQueryParameters)
      return fail(Errc::invalid_argument,
                  fmt::format("the query has more than {} parameters", kMaxQueryParameters));
    auto decoded_name = percent_decode(name, true);
    if (!decoded_name) return tl::unexpected(decoded_name.error());
    auto decoded_value = percent_decode(value, true);
    if (!decoded_value) return tl::unexpected(decoded_value.error());
    fields.emplace_back(std::move(*decoded_name), std::move(*decoded_value));
  }
  return fields;
}

}  // namespace

Result<std::string> percent_decode(std::string_view text, bool plus_is_space) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%') {
      const int hi = i + 2 < text.size() ? hex_value(text[i + 1]) : -1;
      const int lo = i + 2 < text.size() ? hex_value(text[i + 2]) : -1;
      if (hi < 0 || lo < 0)
        return fail(Errc::invalid_argument, "the request target has a broken percent code");
      out.push_back(static_cast<char>(hi * 16 + lo));
      i += 2;
    } else {
      out.push_back(plus_is_space && text[i] == '+' ? ' ' : text[i]);
    }
  }
  return out;
}

Result<Target> parse_target(std::string_view target) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (!target.starts_with(scheme)) continue;
    target.remove_prefix(scheme.size());
    const std::size_t path = target.find_first_of("/?");
    target = path == std::string_view::npos ? std::string_view("/") : target.substr(path);
    break;
  }
  for (const char c : target)
    if (static_cast<unsigned char>(c) <= ' ' || c == '\x7f')
      return fail(Errc::invalid_argument, "the request target has a space or a control character");
  if (target.empty() || target.front() != '/')
    return fail(Errc::invalid_argument, "the request target must start with '/'");
  target = target.substr(0, target.find('#'));
  std::string_view rest = target;
  const std::string_view path = take_part(rest, '?');

  auto segments = parse_path(path);
  if (!segments) return tl::unexpected(segments.error());
  auto query = parse_query(rest);
  if (!query) return tl::unexpected(query.error());
  return Target{std::move(*segments), std::move(*query)};
}

}  // namespace ls::http
