#include "coordinator/http/message/message.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/beast/http/status.hpp>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <iterator>
#include <nlohmann/json.hpp>

#include "coordinator/http/message/limits.h"
#include "core/base/overloaded.h"
#include "core/base/safe_text.h"

namespace ls::http {
namespace {

// The methods' names, in the order of the enum Method
constexpr std::array<std::string_view, 7> kMethods = {"GET",   "HEAD",   "POST",   "PUT",
                                                      "PATCH", "DELETE", "OPTIONS"};

}  // namespace

std::string_view to_string(Method method) { return kMethods[static_cast<std::size_t>(method)]; }

std::optional<Method> parse_method(std::string_view name) {
  const auto found = std::find(kMethods.begin(), kMethods.end(), name);
  return found == kMethods.end() ? std::nullopt
                                 : std::optional(static_cast<Method>(found - kMethods.begin()));
}

std::string lower_case(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return out;
}

std::string_view take_part(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view part = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  return part;
}

std::string_view Request::header(std::string_view lower_case_name) const {
  for (const auto& [name, value] : headers)
    if (name == lower_case_name) return value;
  return {};
}

std::optional<std::string_view> Request::parameter(std::string_view wanted) const {
  for (const auto& [name, value] : query)
    if (name == wanted) return value;
  return std::nullopt;
}

std::span<const std::byte> Response::bytes() const {
  return std::visit(overloaded{[](const std::string& s) { return std::as_bytes(std::span(s)); },
                               [](const std::vector<std::byte>& v) { return std::span<const std::byte>(v); },
                               [](std::span<const std::byte> s) { return s; },
                               [](const FileBody&) { return std::span<const std::byte>(); }},
                    body);
}

std::uint64_t Response::length() const {
  const auto* file = std::get_if<FileBody>(&body);
  return file ? file->size : bytes().size();
}

std::uint64_t Response::in_memory() const {
  return std::holds_alternative<std::span<const std::byte>>(body) ? 0 : bytes().size();
}

Response text_response(int status, std::string content_type, std::string body) {
  return {.status = status, .content_type = std::move(content_type), .body = std::move(body)};
}

Response json_response(int status, std::string json) {
  return text_response(status, "application/json", std::move(json));
}

std::string_view reason_phrase(int status) {
  return boost::beast::http::obsolete_reason(
      boost::beast::http::int_to_status(static_cast<unsigned>(status)));
}

namespace {

constexpr std::pair<Errc, int> kStatus[] = {
    {Errc::invalid_argument, 400},    {Errc::not_found, 404},          {Errc::already_exists, 409},
    {Errc::failed_precondition, 409}, {Errc::resource_exhausted, 507}, {Errc::permission_denied, 403},
    {Errc::unauthenticated, 401},     {Errc::unavailable, 503},        {Errc::internal, 500}};

Response problem_of(int status, const nlohmann::ordered_json& json, Fields headers = {}) {
  // The texts in `json` may quote bytes of a scene that are not valid UTF-8. Such bytes are replaced, so that
  // dump() never throws.
  Response response =
      text_response(status, "application/problem+json",
                    json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  response.headers = std::move(headers);
  if (status == 401) response.headers.emplace_back("WWW-Authenticate", "Bearer realm=\"lightshaft\"");
  if (status == 503) response.headers.emplace_back("Retry-After", "2");
  return response;
}

nlohmann::ordered_json base(int status, std::string_view type, std::string_view detail) {
  return {{"type", type}, {"title", reason_phrase(status)}, {"status", status}, {"detail", detail}};
}

}  // namespace

int status_of(Errc code) {
  for (const auto& [known, status] : kStatus)
    if (known == code) return status;
  return 500;
}

Response problem(int status, std::string_view detail, Fields headers) {
  return problem_of(status, base(status, "about:blank", detail), std::move(headers));
}

Response too_many(int wait_seconds, std::string_view detail) {
  return problem(429, detail, {{"Retry-After", std::to_string(wait_seconds)}});
}

Response problem(const Error& error) { return problem(status_of(error.code), error.message); }

Response problem(const Error& error, std::span<const Diagnostic> diagnostics) {
  if (diagnostics.empty()) return problem(error);
  const int status = status_of(error.code);
  auto json = base(status, "urn:lightshaft:problem:scene-rejected", error.message);
  auto& list = json["diagnostics"] = nlohmann::ordered_json::array();
  for (const auto& d : diagnostics)
    list.push_back({{"severity", d.severity == Diagnostic::Severity::error ? "error" : "warning"},
                    {"file", d.place.file},
                    {"line", d.place.line},
                    {"column", d.place.column},
                    {"text", d.text},
                    {"source_line", d.source_line},
                    {"length", d.length}});
  return problem_of(status, json);
}

std::string media_type(std::string_view content_type) {
  std::string type = lower_case(content_type.substr(0, content_type.find(';')));
  while (!type.empty() && (type.back() == ' ' || type.back() == '\t')) type.pop_back();
  return type;
}

Result<FileBody> open_file_body(const std::filesystem::path& path) {
  auto file = std::make_shared<const Descriptor>(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file->fd < 0)
    return fail(errno == ENOENT ? Errc::not_found : Errc::unavailable,
                fmt::format("cannot open {}: {}", path.string(), std::strerror(errno)));
  struct stat info {};
  if (::fstat(file->fd, &info) != 0)
    return fail(Errc::unavailable, fmt::format("cannot look at {}: {}", path.string(), std::strerror(errno)));
  return FileBody{std::move(file), static_cast<std::uint64_t>(info.st_size)};
}

std::size_t read_slice(const FileBody& file, std::uint64_t offset, std::span<std::byte> into) {
  ssize_t n = -1;
  do n = ::pread(file.opened->fd, into.data(), into.size(), static_cast<off_t>(offset));
  while (n < 0 && errno == EINTR);
  return n < 0 ? 0 : static_cast<std::size_t>(n);
}

namespace {

bool has(const Response& response, std::string_view name) {
  return std::any_of(response.headers.begin(), response.headers.end(),
                     [&](const auto& field) { return field.first == name; });
}

}  // namespace

std::string head_text(const Response& response, const HeadOptions& options, std::int64_t unix_seconds) {
  std::string out = fmt::format("HTTP/1.1 {} {}\r\n", response.status, reason_phrase(response.status));
  const auto field = [&out](std::string_view name, std::string_view value) {
    fmt::format_to(std::back_inserter(out), "{}: {}\r\n", name, value);
  };
  field("Date", fmt::format("{:%a, %d %b %Y %H:%M:%S} GMT", fmt::gmtime(std::time_t{unix_seconds})));
  if (!response.content_type.empty()) field("Content-Type", response.content_type);
  const bool bodyless = response.status == 204 || response.status == 304;
  // The response to HEAD has the Content-Length that the response to GET would have. This length is unknown
  // if the handler answers HEAD without making the body of the GET response; it then sets no content type.
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

namespace {

// Decodes percent codes. `plus_is_space`: '+' stands for a space, as it does in queries but not in paths.
Result<std::string> decode(std::string_view text, bool plus_is_space) {
  std::string coded(text);
  if (plus_is_space) std::replace(coded.begin(), coded.end(), '+', ' ');
  auto plain = percent_decode(coded);
  if (!plain) return fail(Errc::invalid_argument, "the request target has a broken percent code");
  return std::move(*plain);
}

Result<std::vector<std::string>> parse_path(std::string_view path) {
  std::vector<std::string> segments;
  path.remove_prefix(1);
  while (!path.empty()) {
    auto segment = decode(take_part(path, '/'), false);
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
    auto decoded_name = decode(name, true);
    if (!decoded_name) return tl::unexpected(decoded_name.error());
    auto decoded_value = decode(value, true);
    if (!decoded_value) return tl::unexpected(decoded_value.error());
    fields.emplace_back(std::move(*decoded_name), std::move(*decoded_value));
  }
  return fields;
}

}  // namespace

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
