// The texts of scene files, positions in them, and a report that collects diagnostics (errors and warnings)
// about them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/text/utf8.h"
#include "core/scene/diagnostic.h"

namespace ls::scene {

// A range of one of the files that were read: the bytes [offset, offset + length) of the file with index
// `file`.
struct Span {
  std::uint32_t file = 0;
  std::size_t offset = 0;
  std::size_t length = 1;
  bool operator==(const Span&) const = default;
};

class SourceText {
 public:
  // A function that returns the JSON path of the value at an offset in the text; a diagnostic about this
  // offset begins with the path. It is empty if the text is not JSON.
  using PathOf = std::function<std::string(std::size_t)>;
  SourceText(std::string name, std::string text, PathOf path_of = {});

  const std::string& name() const { return name_; }
  const std::string& text() const { return text_; }
  // Returns line and column of the byte at `offset`, both counted from 1. The column counts characters (UTF-8
  // code points), not bytes. The call takes time proportional to the length of the line.
  SourcePlace place(std::size_t offset) const;
  int line(std::size_t offset) const;  // returns the line only, in constant time
  std::size_t index_bytes() const { return lines_before_.size() * sizeof lines_before_[0]; }
  // Makes a diagnostic about the bytes [offset, offset + length). It contains the source line of these bytes,
  // unless the line is very long.
  Diagnostic diagnose(Diagnostic::Severity severity, std::size_t offset, std::size_t length,
                      std::string message) const;

 private:
  std::size_t line_start(std::size_t offset) const;
  std::string name_, text_;
  PathOf path_of_;
  // The number of line ends before each block of 4096 bytes of the text. (One entry for each line would take
  // four times the memory of a text that consists of empty lines.)
  std::vector<std::uint32_t> lines_before_;
};

// Collects up to kMaxDiagnostics diagnostics while a scene is read.
class Report {
 public:
  explicit Report(bool strict) : strict_(strict) {}

  // Adds a file, which is kept for the lifetime of the report. Returns its index for Span::file.
  std::uint32_t add_file(SourceText file);
  const SourceText& file(std::uint32_t index) const { return files_[index]; }

  void error(const Span& at, std::string text);
  std::nullopt_t refuse(const Span& at, std::string text) {  // reports an error, returns nullopt
    error(at, std::move(text));
    return std::nullopt;
  }
  void warning(const Span& at, std::string text);  // becomes an error under --strict
  // As warning(), but only the first time that this text is given.
  void warning_once(const Span& at, std::string text);

  bool has_errors() const { return errors_ > 0; }
  // True if further errors would be discarded, so that reading may stop.
  bool full() const { return errors_ >= kMax; }
  // True if a further warning would be kept. Check this before work that serves only to find a warning.
  bool takes_warnings() const { return (strict_ ? errors_ : warnings_) < kMax; }
  // Returns the words by which a message about the place `here` refers to another place, `there`: "line 9",
  // or "FILE, line 9" if the two places are in different files.
  std::string refer_to(const Span& there, const Span& here) const;
  // Returns the diagnostics in the order in which they were found. If there are more than kMaxDiagnostics,
  // the errors come first and the last warnings are dropped.
  std::vector<Diagnostic> take();

 private:
  static const std::size_t kMax;
  void add(Diagnostic::Severity severity, const Span& at, std::string text);

  bool strict_;
  std::deque<SourceText> files_;
  std::vector<Diagnostic> found_;
  std::set<std::string> warned_;
  std::size_t errors_ = 0, warnings_ = 0;
};

}  // namespace ls::scene
