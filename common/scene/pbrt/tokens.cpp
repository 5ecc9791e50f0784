#include "common/scene/pbrt/tokens.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/scene/limits.h"

namespace ls::scene::pbrt {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

char unescaped(char c) {
  switch (c) {
    case 'b':
      return '\b';
    case 'f':
      return '\f';
    case 'n':
      return '\n';
    case 'r':
      return '\r';
    case 't':
      return '\t';
    default:
      return c;
  }
}

}  // namespace

const Token* Tokens::peek() {
  if (!next_ && !broken_) next_ = scan();
  return next_ ? &*next_ : nullptr;
}

Token Tokens::take() { return *std::exchange(next_, std::nullopt); }

std::optional<Token> Tokens::scan() {
  const std::string& text = report_.file(file_).text();
  for (;;) {
    at_ = text.find_first_not_of(kBlanks, at_);
    if (at_ == std::string::npos || text[at_] != '#') break;
    at_ = text.find_first_of("\r\n", at_);
    if (at_ == std::string::npos) break;
  }
  if (at_ == std::string::npos) at_ = text.size();
  if (at_ == text.size()) return std::nullopt;
  if (text[at_] == '"') return quoted(text);
  const std::size_t begin = at_;
  if (text[at_] == '[' || text[at_] == ']') {
    ++at_;
    return Token{text[begin] == '[' ? Token::Kind::open : Token::Kind::close, {}, {file_, begin, 1}};
  }
  at_ = std::min(text.find_first_of(" \t\r\n\"[]", begin), text.size());
  return Token{Token::Kind::word,
               text.substr(begin, std::min(at_ - begin, kMaxValueBytes)),
               {file_, begin, at_ - begin}};
}

std::optional<Token> Tokens::quoted(const std::string& text) {
  const std::size_t begin = at_++;
  Token token{Token::Kind::quoted, {}, {file_, begin + 1, 1}};
  while (at_ < text.size() && text[at_] != '"' && text[at_] != '\n' && token.text.size() < kMaxValueBytes) {
    if (text[at_] == '\\' && at_ + 1 < text.size())
      token.text += unescaped(text[++at_]);
    else
      token.text += text[at_];
    ++at_;
  }
  if (at_ >= text.size() || text[at_] != '"') {
    broken_ = true;
    report_.error({file_, begin, 1},
                  token.text.size() < kMaxValueBytes
                      ? std::string("this quoted text does not end in its line: a \" is missing")
                      : fmt::format("this quoted text is longer than {} bytes", kMaxValueBytes));
    return std::nullopt;
  }
  token.at.length = std::max<std::size_t>(1, at_ - begin - 1);
  ++at_;
  if (find_control(token.text) == std::string_view::npos) return token;
  broken_ = true;
  report_.error({file_, begin, 1}, "this quoted text has control characters in it");
  return std::nullopt;
}

}  // namespace ls::scene::pbrt
