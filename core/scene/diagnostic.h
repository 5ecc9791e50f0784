// Errors and warnings about a scene, with their place in the text.
#pragma once

#include <string>
#include <vector>

namespace ls {

struct SourcePlace {
  std::string file;
  int line = 0, column = 0;  // counted from 1; 0: the message is about the file as a whole
  bool operator==(const SourcePlace&) const = default;
};

struct Diagnostic {
  enum class Severity { warning, error };
  Severity severity = Severity::error;
  SourcePlace place;
  std::string text;
  // The text of the line with the error, to be shown with a caret below; empty: none.
  std::string source_line;
  int length = 1;  // length of the underlined part, in characters
  bool operator==(const Diagnostic&) const = default;
};

// Returns "file:line:column: error: text", followed by the line and a caret under the place.
std::string format_diagnostic(const Diagnostic& d);
std::string format_diagnostics(const std::vector<Diagnostic>& all);

}  // namespace ls
