// Collects what is wrong with a scene while it is read, up to kMaxDiagnostics.
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "common/scene/source_text.h"

namespace ls::scene {

class Report {
 public:
  explicit Report(bool strict) : strict_(strict) {}

  // Files live as long as the report; the returned index goes into Span::file.
  std::uint32_t add_file(SourceText file);
  const SourceText& file(std::uint32_t index) const { return files_[index]; }

  void error(const Span& at, std::string text);
  void warning(const Span& at, std::string text);  // an error under --strict

  bool has_errors() const { return errors_ > 0; }
  bool full() const { return errors_ >= kMax; }  // more would not be shown: reading may stop
  // Further warnings would be shown. Whoever has to work for the text of one asks first.
  bool takes_warnings() const { return (strict_ ? errors_ : warnings_) < kMax; }
  // "line 9", with the file's name if it is not the one of `here`.
  std::string refer_to(const Span& there, const Span& here) const;
  std::vector<Diagnostic> take();  // in the order found, errors kept before warnings when there are too many

 private:
  static const std::size_t kMax;
  void add(Diagnostic::Severity severity, const Span& at, std::string text);

  bool strict_;
  std::deque<SourceText> files_;
  std::vector<Diagnostic> found_;
  std::size_t errors_ = 0, warnings_ = 0;
};

}  // namespace ls::scene
