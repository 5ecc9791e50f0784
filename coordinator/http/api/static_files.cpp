#include "coordinator/http/api/static_files.h"

#include <array>

#include "common/base/digest.h"

namespace ls::http {
namespace {

struct Type {
  std::string_view ending;
  std::string_view content_type;
};
constexpr std::array kTypes = {
    Type{".html", "text/html; charset=utf-8"},
    Type{".js", "text/javascript; charset=utf-8"},
    Type{".mjs", "text/javascript; charset=utf-8"},
    Type{".css", "text/css; charset=utf-8"},
    Type{".svg", "image/svg+xml"},
    Type{".png", "image/png"},
    Type{".ico", "image/x-icon"},
    Type{".json", "application/json"},
    Type{".webmanifest", "application/manifest+json"},
    Type{".woff2", "font/woff2"},
    Type{".txt", "text/plain; charset=utf-8"},
};

constexpr std::string_view kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; manifest-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'";

std::string joined(std::span<const std::string> segments) {
  std::string path;
  for (const auto& segment : segments) {
    if (!path.empty()) path += '/';
    path += segment;
  }
  return path.empty() ? "index.html" : path;
}

}  // namespace

std::string_view content_type_of(std::string_view file_name) {
  for (const auto& type : kTypes)
    if (file_name.ends_with(type.ending)) return type.content_type;
  return "application/octet-stream";
}

StaticFiles::StaticFiles(std::span<const StaticFile> files) {
  for (const auto& file : files)
    entries_.emplace(std::string(file.name), Entry{file.bytes, content_type_of(file.name),
                                                   "\"" + sha256(file.bytes).hex().substr(0, 32) + "\""});
}

std::optional<Response> StaticFiles::find(const Request& request) const {
  const auto found = entries_.find(joined(request.segments));
  if (found == entries_.end()) return std::nullopt;
  const Entry& entry = found->second;
  Response response;
  response.headers.emplace_back("ETag", entry.etag);
  // The browser checks for changes each time, and gets a 304 if the file has not changed.
  response.headers.emplace_back("Cache-Control", "no-cache");
  response.headers.emplace_back("Content-Security-Policy", kPagePolicy);
  if (request.header("if-none-match").find(entry.etag) != std::string_view::npos) {
    response.status = 304;
    return response;
  }
  response.content_type = entry.content_type;
  response.body = entry.bytes;
  return response;
}

}  // namespace ls::http
