#include "coordinator/http/net/head_text.h"

#include <fmt/format.h>

#include <array>
#include <ctime>
#include <iterator>

namespace ls::http {
namespace {

std::string http_date(std::int64_t unix_seconds) {
  // Not strftime: its day names depend on the locale.
  static constexpr std::array kDays = {"Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"};
  static constexpr std::array kMonths = {"Jan", "Feb", "Mar", "Apr", "May", "Jun",
                                         "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};
  const std::time_t time = static_cast<std::time_t>(unix_seconds);
  std::tm t{};
  gmtime_r(&time, &t);
  return fmt::format("{}, {:02} {} {} {:02}:{:02}:{:02} GMT", kDays[static_cast<std::size_t>(t.tm_wday)],
                     t.tm_mday, kMonths[static_cast<std::size_t>(t.tm_mon)], 1900 + t.tm_year, t.tm_hour,
                     t.tm_min, t.tm_sec);
}

bool has(const Response& response, std::string_view name) {
  for (const auto& field : response.headers)
    if (field.first == name) return true;
  return false;
}

}  // namespace

std::string head_text(const Response& response, const HeadOptions& options, std::int64_t unix_seconds) {
  std::string out = fmt::format("HTTP/1.1 {} {}\r\n", response.status, reason_phrase(response.status));
  const auto field = [&out](std::string_view name, std::string_view value) {
    fmt::format_to(std::back_inserter(out), "{}: {}\r\n", name, value);
  };
  field("Date", http_date(unix_seconds));
  if (!response.content_type.empty()) field("Content-Type", response.content_type);
  const bool bodyless = response.status == 204 || response.status == 304;
  // The answer to HEAD has the length of the answer to GET. If a route answers HEAD by itself, without a
  // content type, there is no length to report.
  const bool unknown = options.streamed || (options.method == Method::head && response.content_type.empty());
  if (!bodyless && !unknown) field("Content-Length", fmt::format("{}", response.length()));
  for (const auto& [name, value] : response.headers) field(name, value);
  if (!has(response, "Cache-Control")) field("Cache-Control", "no-store");
  if (!has(response, "Content-Security-Policy"))
    field("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'");
  field("X-Content-Type-Options", "nosniff");
  field("Referrer-Policy", "no-referrer");
  field("Connection", options.keep_alive ? "keep-alive" : "close");
  out += "\r\n";
  return out;
}

}  // namespace ls::http
