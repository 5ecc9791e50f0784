#include "core/scene/diagnostic.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "core/base/safe_text.h"
#include "core/base/text/utf8.h"
#include "core/scene/limits.h"

namespace ls {
namespace {

using scene::kMaxExcerptBytes;

// Returns the part of `text` from character number `first` up to but excluding character number `last`.
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

// Returns the source line of a diagnostic and, below it, a line with a caret under the diagnostic's position.
// A long line is cut to the part around that position.
std::string excerpt(const Diagnostic& d) {
  const std::size_t column = static_cast<std::size_t>(std::max(1, d.place.column)) - 1;
  const std::size_t first = column > kMaxExcerptBytes / 2 ? column - kMaxExcerptBytes / 2 : 0;
  // plain_text() does not change columns, so the caret's position is right.
  const std::string line = plain_text(characters(d.source_line, first, first + kMaxExcerptBytes));
  const std::string number = std::to_string(d.place.line);
  const std::size_t room = first + kMaxExcerptBytes - column;
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
