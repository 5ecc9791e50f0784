#include "coordinator/http/api/static_files.h"

#include <fmt/ranges.h>

#include <utility>

#include "common/base/digest.h"

namespace ls::http {
namespace {

constexpr std::pair<std::string_view, std::string_view> kTypes[] = {
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".mjs", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".ico", "image/x-icon"},
    {".json", "application/json"},
    {".webmanifest", "application/manifest+json"},
    {".woff2", "font/woff2"},
    {".txt", "text/plain; charset=utf-8"},
};

constexpr std::string_view kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; manifest-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'";

}  // namespace

std::string_view content_type_of(std::string_view file_name) {
  for (const auto& [ending, type] : kTypes)
    if (file_name.ends_with(ending)) return type;
  return "application/octet-stream";
}

StaticFiles::StaticFiles(std::span<const StaticFile> files) {
  for (const auto& file : files)
    entries_.emplace(std::string(file.name), Entry{file.bytes, content_type_of(file.name),
                                                   "\"" + sha256(file.bytes).hex().substr(0, 32) + "\""});
}

std::optional<Response> StaticFiles::find(const Request& request) const {
  const auto found = entries_.find(
      request.segments.empty() ? "index.html" : fmt::format("{}", fmt::join(request.segments, "/")));
  if (found == entries_.end()) return std::nullopt;
  const Entry& entry = found->second;
  // With "no-cache" the browser checks for changes each time, and gets a 304 if the file has not changed.
  Response response{.headers = {{"ETag", entry.etag},
                                {"Cache-Control", "no-cache"},
                                {"Content-Security-Policy", std::string(kPagePolicy)}}};
  if (request.header("if-none-match").find(entry.etag) != std::string_view::npos) {
    response.status = 304;
    return response;
  }
  response.content_type = entry.content_type;
  response.body = entry.bytes;
  return response;
}

}  // namespace ls::http
