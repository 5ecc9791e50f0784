#include "formats/xml/source_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/scene/diagnostic.h"
#include "core/scene/limits.h"

namespace ls::scene {
namespace {

constexpr std::size_t kBlock = 4096;
static_assert(kMaxTextBytes < std::size_t{1} << 31, "numbers of lines are ints");

int count_characters(std::string_view text) {
  return static_cast<int>(
      std::count_if(text.begin(), text.end(), [](char c) { return !is_continuation(c); }));
}

std::uint32_t count_lines(std::string_view text) {
  return static_cast<std::uint32_t>(std::count(text.begin(), text.end(), '\n'));
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

}  // namespace ls::scene
