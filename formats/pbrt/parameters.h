// Splits the text of a pbrt file into tokens, and reads the parameters of objects from them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/light/colour_space.h"
#include "core/scene/scene_values.h"
#include "formats/pbrt/vocabulary.h"
#include "formats/xml/source_text.h"

namespace ls::scene::pbrt {

struct Token {
  enum class Kind { word, quoted, open, close };
  Kind kind = Kind::word;
  std::string text;  // for a quoted text: without its quotes, and with escapes decoded
  Span at;
};

// Splits the text of a file into words, quoted texts and brackets, with their places.
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

struct Param {
  std::string type, name;                   // for example "rgb" and "reflectance"
  Span at;                                  // place of the declaration
  ColourSpace space = ColourSpace::rec709;  // of values of type rgb, as the last directive ColorSpace says
  std::vector<double> numbers;
  std::vector<std::string> texts;  // values that are quoted texts, and the words true and false
};

// Reads the parameters that follow a directive. nullopt: they are wrong, which was reported.
std::optional<std::vector<Param>> read_params(Tokens& tokens, Report& report);

// The parameters of one object. The code that translates the object takes each parameter by its name.
// finish() reports the parameters that were not taken: as errors, or with a warning if the table in
// vocabulary.h marks them as ignored. A parameter that is refused may be given with its default value.
class Params {
 public:
  Params(const Row& row, const Span& at, std::vector<Param> params, Report& report);

  const Span& at() const { return at_; }
  const Row& row() const { return *row_; }
  std::string title() const;  // for example: Shape "sphere"
  bool has(std::string_view name) const;
  // Returns nullptr if there is no such parameter, or if its type is wrong, which is reported.
  const Param* take(std::string_view name);
  double number(std::string_view name, double fallback);
  int integer(std::string_view name, int fallback);
  bool boolean(std::string_view name, bool fallback);
  std::string text(std::string_view name, std::string_view fallback);
  Vec3 triple(std::string_view name, const Vec3& fallback);
  void error(const Span& at, std::string text) { report_->error(at, std::move(text)); }
  std::nullopt_t refuse(const Span& at, std::string text) { return report_->refuse(at, std::move(text)); }
  void missing(std::string_view name);
  void finish();

 private:
  struct Given {
    Param param;
    bool taken = false;
  };
  bool is_one(const Param& p, std::size_t numbers, std::size_t texts);
  static bool is_default(const Param& p, const Word& word);
  const Row* row_;
  Span at_;
  std::vector<Given> given_;
  Report* report_;
};

}  // namespace ls::scene::pbrt
