#include "util/report/html.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/digest.h"
#include "core/base/safe_text.h"

namespace ls::report {
namespace {

void append_escaped(std::string& out, std::string_view line) {
  static constexpr std::pair<char, std::string_view> kCodes[] = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
  for (const char c : plain_text(line)) {
    const auto* code = std::ranges::find(kCodes, c, &std::pair<char, std::string_view>::first);
    code == std::end(kCodes) ? out += c : out += code->second;
  }
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t end = 0; (end = text.find('\n')) != std::string_view::npos; text.remove_prefix(end + 1)) {
    append_escaped(out, text.substr(0, end));
    out += '\n';
  }
  append_escaped(out, text);
  return out;
}

std::string base64(std::span<const std::byte> bytes) {
  // One more character than the result, for the NUL that OpenSSL writes at the end.
  std::string out(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data()),
                  reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
  out.pop_back();
  return out;
}

std::string data_url(std::string_view media_type, std::span<const std::byte> bytes) {
  return fmt::format("data:{};base64,{}", media_type, base64(bytes));
}

std::string document_policy(std::string_view css) {
  const Digest digest = sha256(std::as_bytes(std::span(css)));
  return fmt::format(
      "default-src 'none'; img-src data:; style-src 'sha256-{}'; base-uri 'none'; form-action 'none'",
      base64(std::as_bytes(std::span(digest.bytes))));
}

std::string document(std::string_view title, std::string_view css, std::string_view body) {
  return fmt::format(R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="referrer" content="no-referrer">
<title>{}</title>
<style>{}</style>
</head>
<body>
{}
</body>
</html>
)",
                     document_policy(css), escape_html(title), css, body);
}

}  // namespace ls::report
