#include "coordinator/http/api/static_files.h"

#include <fmt/ranges.h>

#include <utility>

#include "coordinator/http/api/content_coding.h"
#include "coordinator/http/api/page_bundle.h"
#include "core/base/digest.h"

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
  for (const auto& file : files) add(std::string(file.name), file.bytes, false);
  auto bundle = bundle_page(files);
  if (!bundle) return;
  bundle->scripts.push_back(std::move(bundle->style));
  for (JoinedFile& file : bundle->scripts) add(std::move(file.name), keep(std::move(file.text)), true);
  add("index.html", keep(std::move(bundle->page)), false);
}

std::span<const std::byte> StaticFiles::keep(std::string text) {
  return std::as_bytes(std::span(*made_.emplace_back(std::make_shared<const std::string>(std::move(text)))));
}

void StaticFiles::add(std::string name, std::span<const std::byte> bytes, bool immutable) {
  const std::string_view type = content_type_of(name);
  Entry entry{bytes, {}, type, sha256(bytes).hex().substr(0, 32), immutable};
  if (auto shorter = gzipped(bytes)) entry.gzip = keep(std::move(*shorter));
  entries_[std::move(name)] = std::move(entry);
}

std::optional<Response> StaticFiles::find(const Request& request) const {
  const auto found = entries_.find(
      request.segments.empty() ? "index.html" : fmt::format("{}", fmt::join(request.segments, "/")));
  if (found == entries_.end()) return std::nullopt;
  const Entry& entry = found->second;
  const bool gzip = !entry.gzip.empty() && accepts_gzip(request);
  // With "no-cache" the browser checks for changes each time, and gets a 304 if the file has not changed. A
  // file whose name contains its digest never changes.
  Response response{
      .headers = {{"ETag", fmt::format("\"{}{}\"", entry.digest, gzip ? "-gzip" : "")},
                  {"Cache-Control", entry.immutable ? "public, max-age=31536000, immutable" : "no-cache"},
                  {"Vary", "Accept-Encoding"},
                  {"Content-Security-Policy", std::string(kPagePolicy)}}};
  if (request.header("if-none-match").find(entry.digest) != std::string_view::npos) {
    response.status = 304;
    return response;
  }
  response.content_type = entry.content_type;
  if (gzip) response.headers.emplace_back("Content-Encoding", "gzip");
  response.body = gzip ? entry.gzip : entry.bytes;
  return response;
}

}  // namespace ls::http
