// Splits the text of a pbrt file into words, quoted texts and brackets, with their places.
#pragma once

#include <optional>
#include <string>

#include "common/scene/xml/error_report.h"

namespace ls::scene::pbrt {

struct Token {
  enum class Kind { word, quoted, open, close };
  Kind kind = Kind::word;
  std::string text;  // for a quoted text: without its quotes, and with escapes decoded
  Span at;
};

class Tokens {
 public:
  Tokens(std::uint32_t file, Report& report) : file_(file), report_(report) {}

  // Returns the next token. Returns nullptr at the end, and also where the text is malformed, which is
  // reported.
  const Token* peek();
  Token take();  // requires that peek() returned a token
  bool broken() const { return broken_; }

 private:
  std::optional<Token> scan();
  std::optional<Token> quoted(const std::string& text);
  std::uint32_t file_;
  Report& report_;
  std::size_t at_ = 0;
  bool broken_ = false;
  std::optional<Token> next_;
};

}  // namespace ls::scene::pbrt
