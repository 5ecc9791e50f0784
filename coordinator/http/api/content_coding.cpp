#include "coordinator/http/api/content_coding.h"

#include <zlib.h>

#include <string_view>
#include <utility>

namespace ls::http {
namespace {

constexpr std::size_t kWorthIt = 1400;  // bytes; a shorter body fits into one packet anyway
constexpr int kGzip = 15 + 16;          // zlib: the largest window, and a gzip header
constexpr int kMemory = 8;              // zlib: its default

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

}  // namespace

bool accepts_gzip(const Request& request) {
  const std::string field = lower_case(request.header("accept-encoding"));
  std::string_view rest = field;
  while (!rest.empty()) {
    std::string_view parameters = take_part(rest, ',');
    const std::string_view coding = trimmed(take_part(parameters, ';'));
    if (coding != "gzip") continue;
    const std::string_view weight = trimmed(parameters);  // "q=0": not acceptable (RFC 9110, 12.4.2)
    return !(weight.starts_with("q=0") && weight.find_first_not_of("0.", 2) == std::string_view::npos);
  }
  return false;
}

std::optional<std::string> gzipped(std::span<const std::byte> bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
    return std::nullopt;
  std::string out(bytes.size(), '\0');
  // zlib does not write to its input
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const bool shorter = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return shorter ? std::optional(std::move(out)) : std::nullopt;
}

void compress(Response& response, const Request& request) {
  const auto* body = std::get_if<std::string>(&response.body);
  if (body == nullptr || body->size() < kWorthIt || !media_type(response.content_type).ends_with("json"))
    return;
  response.headers.emplace_back("Vary", "Accept-Encoding");
  if (!accepts_gzip(request)) return;
  auto shorter = gzipped(std::as_bytes(std::span(*body)));
  if (!shorter) return;
  response.body = std::move(*shorter);
  response.headers.emplace_back("Content-Encoding", "gzip");
}

}  // namespace ls::http
