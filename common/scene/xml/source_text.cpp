#include "common/scene/xml/source_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/base/safe_text.h"
#include "common/scene/diagnostic.h"
#include "common/scene/limits.h"

namespace ls {
namespace scene {
namespace {

constexpr std::size_t kBlock = 4096;
static_assert(kMaxTextBytes < std::size_t{1} << 31, "numbers of lines are ints");

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

int count_characters(std::string_view text) {
  return static_cast<int>(
      std::count_if(text.begin(), text.end(), [](char c) { return !is_continuation(c); }));
}

std::uint32_t count_lines(std::string_view text) {
  return static_cast<std::uint32_t>(std::count(text.begin(), text.end(), '\n'));
}

// Returns the length in bytes of the UTF-8 character at the start of `text`; 0 if it is not well-formed (RFC
// 3629, table 3-7 of Unicode).
std::size_t sequence_length(std::string_view text) {
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = at(0);
  if (lead < 0x80) return 1;
  const std::size_t n = lead >= 0xC2 && lead <= 0xDF   ? 2
                        : (lead & 0xF0) == 0xE0        ? 3
                        : lead >= 0xF0 && lead <= 0xF4 ? 4
                                                       : 0;
  if (n == 0 || text.size() < n) return 0;
  for (std::size_t i = 1; i < n; ++i)
    if (!is_continuation(text[i])) return 0;
  const bool overlong = (lead == 0xE0 && at(1) < 0xA0) || (lead == 0xF0 && at(1) < 0x90);
  const bool out_of_range = (lead == 0xED && at(1) > 0x9F) || (lead == 0xF4 && at(1) > 0x8F);
  return overlong || out_of_range ? 0 : n;
}

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

SourceText::SourceText(std::string name, std::string text, PathOf path_of)
    : name_(std::move(name)), text_(std::move(text)), path_of_(std::move(path_of)) {
  lines_before_.reserve(text_.size() / kBlock + 1);
  std::uint32_t lines = 0;
  for (std::size_t begin = 0; begin <= text_.size(); begin += kBlock) {
    lines_before_.push_back(lines);
    lines += count_lines(std::string_view(text_).substr(begin, kBlock));
  }
}

int SourceText::line(std::size_t offset) const {
  offset = std::min(offset, text_.size());
  const std::size_t block = offset / kBlock, begin = block * kBlock;
  return static_cast<int>(lines_before_[block] +
                          count_lines(std::string_view(text_).substr(begin, offset - begin))) +
         1;
}

std::size_t SourceText::line_start(std::size_t offset) const {
  const std::size_t end = offset == 0 ? std::string::npos : text_.rfind('\n', offset - 1);
  return end == std::string::npos ? 0 : end + 1;
}

SourcePlace SourceText::place(std::size_t offset) const {
  offset = std::min(offset, text_.size());
  const std::size_t start = line_start(offset);
  return {name_, line(offset), count_characters(std::string_view(text_).substr(start, offset - start)) + 1};
}

Diagnostic SourceText::diagnose(Diagnostic::Severity severity, std::size_t offset, std::size_t length,
                                std::string message) const {
  offset = std::min(offset, text_.size());
  if (const std::string path = path_of_ ? path_of_(offset) : ""; !path.empty())
    message = path + ": " + message;
  Diagnostic d{severity, place(offset), std::move(message), {}, 1};
  const std::size_t start = line_start(offset);
  std::size_t end = std::min(text_.find('\n', start), text_.size());
  if (end > start && text_[end - 1] == '\r') --end;
  const std::size_t shown = std::min(length, end - std::min(offset, end));
  d.length = std::max(1, count_characters(std::string_view(text_).substr(std::min(offset, end), shown)));
  // A very long line (more than 20 times what is shown) is left out, to save memory. Any other line is kept
  // as a whole, so that columns count from its start.
  const std::string_view line = std::string_view(text_).substr(start, end - start);
  if (line.size() <= 20 * kMaxExcerptBytes && find_invalid_utf8(line) == std::string_view::npos)
    d.source_line = line;
  return d;
}

std::size_t find_control(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const bool blank = c == '\t' || c == '\n' || c == '\r';
    const bool c1 = c == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0;
    if ((c < 0x20 && !blank) || c == 0x7F || c1) return i;
  }
  return std::string_view::npos;
}

std::size_t find_invalid_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t n = sequence_length(text.substr(i));
    if (n == 0) return i;
    i += n;
  }
  return std::string_view::npos;
}

const std::size_t Report::kMax = kMaxDiagnostics;

std::uint32_t Report::add_file(SourceText file) {
  files_.push_back(std::move(file));
  return static_cast<std::uint32_t>(files_.size() - 1);
}

void Report::error(const Span& at, std::string text) {
  add(Diagnostic::Severity::error, at, std::move(text));
}

void Report::warning(const Span& at, std::string text) {
  add(strict_ ? Diagnostic::Severity::error : Diagnostic::Severity::warning, at, std::move(text));
}

void Report::warning_once(const Span& at, std::string text) {
  if (takes_warnings() && warned_.insert(text).second) warning(at, std::move(text));
}

void Report::add(Diagnostic::Severity severity, const Span& at, std::string text) {
  // Up to kMax errors and up to kMax warnings are kept, so that warnings never displace an error. take() then
  // reduces them to kMax in all.
  std::size_t& count = severity == Diagnostic::Severity::error ? errors_ : warnings_;
  if (count++ >= kMax) return;
  Diagnostic d = files_[at.file].diagnose(severity, at.offset, at.length, std::move(text));
  if (std::find(found_.begin(), found_.end(), d) == found_.end()) found_.push_back(std::move(d));
}

std::string Report::refer_to(const Span& there, const Span& here) const {
  const SourceText& file = files_[there.file];
  const int line = file.line(there.offset);
  return there.file == here.file ? fmt::format("line {}", line)
                                 : fmt::format("{}, line {}", file.name(), line);
}

std::vector<Diagnostic> Report::take() {
  if (found_.size() > kMax) {
    std::stable_partition(found_.begin(), found_.end(),
                          [](const Diagnostic& d) { return d.severity == Diagnostic::Severity::error; });
    found_.resize(kMax);
  }
  return std::exchange(found_, {});
}

}  // namespace scene

std::string format_diagnostic(const Diagnostic& d) {
  const char* severity = d.severity == Diagnostic::Severity::error ? "error" : "warning";
  const std::string file = plain_text(d.place.file), what = plain_text(d.text);
  std::string text =
      d.place.line > 0 ? fmt::format("{}:{}:{}: {}: {}\n", file, d.place.line, d.place.column, severity, what)
                       : fmt::format("{}: {}: {}\n", file, severity, what);
  if (!d.source_line.empty() && d.place.line > 0) text += scene::excerpt(d);
  return text;
}

std::string format_diagnostics(const std::vector<Diagnostic>& all) {
  std::string text;
  for (const Diagnostic& d : all) text += format_diagnostic(d);
  return text;
}

}  // namespace ls
