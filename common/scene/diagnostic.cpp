#include "common/scene/diagnostic.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "common/base/safe_text.h"
#include "common/scene/limits.h"

namespace ls {
namespace {

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

// Returns the bytes of the characters [first, last).
std::string_view characters(std::string_view text, std::size_t first, std::size_t last) {
  std::size_t begin = text.size(), end = text.size(), n = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (is_continuation(text[i])) continue;
    if (n == first) begin = i;
    if (n == last) {
      end = i;
      break;
    }
    ++n;
  }
  return begin < end ? text.substr(begin, end - begin) : std::string_view{};
}

// Returns the line with a caret under the error's position. Only the relevant part of a long line is shown.
std::string excerpt(const Diagnostic& d) {
  const std::size_t column = static_cast<std::size_t>(std::max(1, d.place.column)) - 1;
  const std::size_t first = column > scene::kMaxExcerptBytes / 2 ? column - scene::kMaxExcerptBytes / 2 : 0;
  // plain_text() does not change columns, so the caret's position is right.
  const std::string line = plain_text(characters(d.source_line, first, first + scene::kMaxExcerptBytes));
  const std::string number = std::to_string(d.place.line);
  const std::size_t room = first + scene::kMaxExcerptBytes - column;
  const std::size_t length = std::min<std::size_t>(static_cast<std::size_t>(std::max(1, d.length)), room);
  return fmt::format("  {} | {}\n  {} | {}^{}\n", number, line, std::string(number.size(), ' '),
                     std::string(column - first, ' '), std::string(length - 1, '~'));
}

}  // namespace

std::string format_diagnostic(const Diagnostic& d) {
  const char* severity = d.severity == Diagnostic::Severity::error ? "error" : "warning";
  const std::string file = plain_text(d.place.file), what = plain_text(d.text);
  std::string text =
      d.place.line > 0 ? fmt::format("{}:{}:{}: {}: {}\n", file, d.place.line, d.place.column, severity, what)
                       : fmt::format("{}: {}: {}\n", file, severity, what);
  if (!d.source_line.empty() && d.place.line > 0) text += excerpt(d);
  return text;
}

std::string format_diagnostics(const std::vector<Diagnostic>& all) {
  std::string text;
  for (const Diagnostic& d : all) text += format_diagnostic(d);
  return text;
}

}  // namespace ls
