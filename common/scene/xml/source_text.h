// The text of a scene file, and positions in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/diagnostic.h"

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
  // Returns the path of the value at an offset in a JSON document. Messages about this place begin with the
  // path. An empty function: the text is not JSON.
  using PathOf = std::function<std::string(std::size_t)>;
  SourceText(std::string name, std::string text, PathOf path_of = {});

  const std::string& name() const { return name_; }
  const std::string& text() const { return text_; }
  // Returns line and column of a byte, both from 1. The column counts characters (UTF-8 code points), not
  // bytes. This takes time proportional to the line's length.
  SourcePlace place(std::size_t offset) const;
  int line(std::size_t offset) const;  // returns the line only, in constant time
  std::size_t index_bytes() const { return lines_before_.size() * sizeof lines_before_[0]; }
  // Makes a diagnostic about the bytes [offset, offset + length), with the line that they are in, unless this
  // line is far too long to be shown.
  Diagnostic diagnose(Diagnostic::Severity severity, std::size_t offset, std::size_t length,
                      std::string message) const;

 private:
  std::size_t line_start(std::size_t offset) const;
  std::string name_, text_;
  PathOf path_of_;
  // The number of line ends before each block of the text. (An entry for each line would make this many times
  // the size of a text that consists of empty lines.)
  std::vector<std::uint32_t> lines_before_;
};

// Returns the offset of the first byte that is not well-formed UTF-8; npos if there is none.
std::size_t find_invalid_utf8(std::string_view text);
// Returns the offset of the first control character in well-formed UTF-8 (below U+0020 except tabs and line
// ends, U+007F to U+009F); npos if there is none.
std::size_t find_control(std::string_view text);

}  // namespace ls::scene
