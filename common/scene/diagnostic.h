// Errors and warnings about a scene, with their place in the text.
#pragma once

#include <string>
#include <vector>

namespace ls {

struct SourcePlace {
  std::string file;
  int line = 0, column = 0;  // counted from 1; 0: the file as a whole
  bool operator==(const SourcePlace&) const = default;
};

struct Diagnostic {
  enum class Severity { warning, error };
  Severity severity = Severity::error;
  SourcePlace place;
  std::string text;
  std::string source_line;  // the line of the error, shown with a caret; empty if there is none
  int length = 1;           // length of the underlined part, in characters
  bool operator==(const Diagnostic&) const = default;
};

// Returns "file:line:column: error: text", followed by the line and a caret under the place.
std::string format_diagnostic(const Diagnostic& d);
std::string format_diagnostics(const std::vector<Diagnostic>& all);

}  // namespace ls
