// Collects the diagnostics while a scene is read, up to kMaxDiagnostics.
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "common/scene/xml/source_text.h"

namespace ls::scene {

class Report {
 public:
  explicit Report(bool strict) : strict_(strict) {}

  // Adds a file, which is kept as long as the report. Returns its index for Span::file.
  std::uint32_t add_file(SourceText file);
  const SourceText& file(std::uint32_t index) const { return files_[index]; }

  void error(const Span& at, std::string text);
  void warning(const Span& at, std::string text);  // becomes an error under --strict

  bool has_errors() const { return errors_ > 0; }
  // True if further errors would not be shown, so that reading may stop
  bool full() const { return errors_ >= kMax; }
  // True if a further warning would be shown; check this before composing a warning that costs much time.
  bool takes_warnings() const { return (strict_ ? errors_ : warnings_) < kMax; }
  // Returns text that refers to the place `there` in a message about `here`: "line 9", with the file's name
  // if the two are in different files.
  std::string refer_to(const Span& there, const Span& here) const;
  // Returns the diagnostics in the order found; if there are too many, errors are kept before warnings
  std::vector<Diagnostic> take();

 private:
  static const std::size_t kMax;
  void add(Diagnostic::Severity severity, const Span& at, std::string text);

  bool strict_;
  std::deque<SourceText> files_;
  std::vector<Diagnostic> found_;
  std::size_t errors_ = 0, warnings_ = 0;
};

}  // namespace ls::scene
