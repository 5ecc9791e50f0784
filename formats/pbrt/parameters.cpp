#include "formats/pbrt/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/check.h"
#include "core/base/parse_number.h"
#include "core/base/text/suggest.h"
#include "core/scene/limits.h"

namespace ls::scene::pbrt {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

char unescaped(char c) {
  const std::size_t i = std::string_view("bfnrt").find(c);
  return i == std::string_view::npos ? c : "\b\f\n\r\t"[i];
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
    return report_.refuse({file_, begin, 1},
                          token.text.size() < kMaxValueBytes
                              ? std::string("this quoted text does not end in its line: a \" is missing")
                              : fmt::format("this quoted text is longer than {} bytes", kMaxValueBytes));
  }
  token.at.length = std::max<std::size_t>(1, at_ - begin - 1);
  ++at_;
  if (find_control(token.text) == std::string_view::npos) return token;
  broken_ = true;
  return report_.refuse({file_, begin, 1}, "this quoted text has control characters in it");
}

namespace {

// pbrt's numbers have single precision.
constexpr double kLargest = std::numeric_limits<float>::max();

constexpr std::pair<std::string_view, std::string_view> kSynonyms[] = {
    {"point", "point3"}, {"vector", "vector3"}, {"normal3", "normal"}, {"color", "rgb"}};

std::string_view plain_type(std::string_view type) {
  for (const auto& [synonym, name] : kSynonyms)
    if (type == synonym) return name;
  return type;
}

bool is_among(std::string_view type, std::string_view types) {
  for (;;) {
    const std::size_t end = std::min(types.find('|'), types.size());
    if (types.substr(0, end) == type) return true;
    if (end == types.size()) return false;
    types.remove_prefix(end + 1);
  }
}

// Returns how many numbers one value of this type has.
std::size_t stride(std::string_view type) {
  if (type == "point2" || type == "vector2") return 2;
  return type == "point3" || type == "vector3" || type == "normal" || type == "rgb" || type == "xyz" ? 3 : 1;
}

class ParamReader {
 public:
  ParamReader(Tokens& tokens, Report& report) : tokens_(tokens), report_(report) {}

  std::optional<std::vector<Param>> run() {
    std::vector<Param> all;
    for (const Token* next = tokens_.peek(); next && next->kind == Token::Kind::quoted;
         next = tokens_.peek()) {
      if (all.size() >= kMaxPbrtParameters)
        return report_.refuse(next->at, "more parameters than any object has");
      auto p = declared(tokens_.take());
      if (!p || !read_values(*p)) return std::nullopt;
      if (std::any_of(all.begin(), all.end(), [&](const Param& other) { return other.name == p->name; }))
        return report_.refuse(p->at, fmt::format("a second '{}'", p->name));
      all.push_back(std::move(*p));
    }
    if (tokens_.broken()) return std::nullopt;
    return all;
  }

 private:
  // Parses the declaration of a parameter: a quoted text "type name".
  std::optional<Param> declared(const Token& token) {
    const std::string& text = token.text;
    const std::size_t begin = text.find_first_not_of(" \t"), blank = text.find_first_of(" \t", begin);
    const std::size_t name = blank == std::string::npos ? blank : text.find_first_not_of(" \t", blank);
    if (name == std::string::npos)
      return report_.refuse(token.at, "a parameter is written as \"type name\", such as \"float radius\"");
    const std::size_t end = std::min(text.find_first_of(" \t", name), text.size());
    return Param{std::string(plain_type(std::string_view(text).substr(begin, blank - begin))),
                 text.substr(name, end - name),
                 token.at,
                 {},
                 {},
                 {}};
  }

  bool read_values(Param& p) {
    const Token* next = tokens_.peek();
    if (!next || next->kind == Token::Kind::close) {
      if (!tokens_.broken()) report_.refuse(next ? next->at : p.at, fmt::format("'{}' has no value", p.name));
      return false;
    }
    if (next->kind != Token::Kind::open) return read_value(p, tokens_.take());
    const Span open = tokens_.take().at;
    for (next = tokens_.peek(); next && next->kind != Token::Kind::close; next = tokens_.peek()) {
      if (next->kind == Token::Kind::open) return report_.refuse(next->at, "a [ within a ["), false;
      if (!read_value(p, tokens_.take())) return false;
    }
    if (!next) {
      if (!tokens_.broken()) report_.refuse(open, fmt::format("the ] of '{}' is missing", p.name));
      return false;
    }
    tokens_.take();
    return check_count(p);
  }

  bool read_value(Param& p, const Token& token) {
    const bool is_word = token.kind == Token::Kind::word;
    if (token.kind == Token::Kind::quoted || (is_word && (token.text == "true" || token.text == "false"))) {
      if (p.texts.size() >= kMaxPbrtTexts)
        return report_.refuse(token.at, fmt::format("'{}' has more than {} texts", p.name, kMaxPbrtTexts)),
               false;
      p.texts.push_back(token.text);
      return true;
    }
    std::string_view text = token.text;
    if (text.starts_with('+')) text.remove_prefix(1);
    const auto x = ls::parse_number<double>(text);
    if (!x || !(std::abs(*x) <= kLargest))
      return report_.refuse(token.at,
                            fmt::format("'{}' is not a number; '{}' wants one", shown(text), p.name)),
             false;
    p.numbers.push_back(*x);
    return true;
  }

  static std::string shown(std::string_view text) {
    return std::string(text.substr(0, 40)) + (text.size() > 40 ? "..." : "");
  }

  bool check_count(const Param& p) {
    const std::size_t n = stride(p.type);
    if (p.numbers.size() % n == 0) return true;
    return report_.refuse(p.at, fmt::format("'{}' has {} numbers, which is no multiple of {}", p.name,
                                            p.numbers.size(), n)),
           false;
  }

  Tokens& tokens_;
  Report& report_;
};

}  // namespace

std::optional<std::vector<Param>> read_params(Tokens& tokens, Report& report) {
  return ParamReader(tokens, report).run();
}

Params::Params(const Row& row, const Span& at, std::vector<Param> params, Report& report)
    : row_(&row), at_(at), report_(&report) {
  for (Param& p : params) given_.push_back({std::move(p)});
}

std::string Params::title() const { return fmt::format("{} \"{}\"", row_->directive, row_->type); }

bool Params::has(std::string_view name) const {
  return std::any_of(given_.begin(), given_.end(), [&](const Given& g) { return g.param.name == name; });
}

const Param* Params::take(std::string_view name) {
  const Word* word = row_->find(name);
  CHECK(word, "a parameter that the table of words lacks");
  for (Given& g : given_) {
    if (g.param.name != name) continue;
    g.taken = true;
    if (is_among(g.param.type, word->types) || (g.param.type == "integer" && is_among("float", word->types)))
      return &g.param;
    std::string wanted(word->types);
    for (std::size_t i = wanted.find('|'); i != std::string::npos; i = wanted.find('|', i + 4))
      wanted.replace(i, 1, " or ");
    report_->error(g.param.at, fmt::format("'{}' of {} is {}, not {}", name, title(), wanted, g.param.type));
  }
  return nullptr;
}

bool Params::is_one(const Param& p, std::size_t numbers, std::size_t texts) {
  if (p.numbers.size() == numbers && p.texts.size() == texts) return true;
  report_->error(p.at, fmt::format("'{}' of {} wants one value", p.name, title()));
  return false;
}

double Params::number(std::string_view name, double fallback) {
  const Param* p = take(name);
  return p && is_one(*p, 1, 0) ? p->numbers[0] : fallback;
}

int Params::integer(std::string_view name, int fallback) {
  const Param* p = take(name);
  if (!p || !is_one(*p, 1, 0)) return fallback;
  const double x = p->numbers[0];
  if (x == std::floor(x) && std::abs(x) <= std::numeric_limits<int>::max()) return static_cast<int>(x);
  report_->error(p->at, fmt::format("'{}' of {} wants a whole number, not {}", name, title(), x));
  return fallback;
}

bool Params::boolean(std::string_view name, bool fallback) {
  const Param* p = take(name);
  if (!p || !is_one(*p, 0, 1)) return fallback;
  if (p->texts[0] == "true" || p->texts[0] == "false") return p->texts[0] == "true";
  report_->error(p->at, fmt::format("'{}' of {} wants true or false", name, title()));
  return fallback;
}

std::string Params::text(std::string_view name, std::string_view fallback) {
  const Param* p = take(name);
  return p && is_one(*p, 0, 1) ? p->texts[0] : std::string(fallback);
}

Vec3 Params::triple(std::string_view name, const Vec3& fallback) {
  const Param* p = take(name);
  if (!p || !is_one(*p, 3, 0)) return fallback;
  return Vec3{{p->numbers[0], p->numbers[1], p->numbers[2]}};
}

void Params::missing(std::string_view name) {
  report_->error(at_, fmt::format("{} needs '{}'", title(), name));
}

// True if the parameter has the value that the table gives as its default.
bool Params::is_default(const Param& p, const Word& word) {
  if (p.texts.size() == 1 && p.numbers.empty()) return p.texts[0] == word.fallback;
  const auto x = ls::parse_number<double>(word.fallback);
  return x && p.texts.empty() && !p.numbers.empty() &&
         std::all_of(p.numbers.begin(), p.numbers.end(), [&](double given) { return given == *x; });
}

void Params::finish() {
  for (const Given& g : given_) {
    if (g.taken) continue;
    const Word* word = row_->find(g.param.name);
    if (!word) {
      std::vector<std::string> known;
      for (const Word& w : row_->words) known.emplace_back(w.name);
      report_->error(g.param.at, fmt::format("{} has no parameter '{}'{}", title(), g.param.name,
                                             suggestion(g.param.name, known)));
    } else if (word->use == Word::Use::ignored) {
      report_->warning_once(
          g.param.at, fmt::format("'{}' of {} has no effect here: {}", word->name, title(), word->meaning));
    } else if (word->use == Word::Use::refused) {
      if (is_default(g.param, *word)) continue;
      report_->error(g.param.at,
                     fmt::format("'{}' of {} is not read: {}", word->name, title(), word->meaning));
    } else if (word->use == Word::Use::read) {
      report_->error(g.param.at, fmt::format("'{}' of {} has no effect beside the others: leave one out",
                                             word->name, title()));
    }
  }
}

}  // namespace ls::scene::pbrt
