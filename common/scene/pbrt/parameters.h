// The parameters of one pbrt object. The object's reader takes parameters by name, checked against the table
// of vocabulary.h; finish() reports those that the table lacks.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/pbrt/tokens.h"
#include "common/scene/pbrt/vocabulary.h"
#include "common/scene/scene_values.h"

namespace ls::scene::pbrt {

struct Param {
  std::string type, name;  // for example "rgb" and "reflectance"
  Span at;                 // place of the declaration
  std::vector<double> numbers;
  std::vector<std::string> texts;  // quoted values, and true and false
};

// Reads the parameters that follow a directive. nullopt: they are wrong, which was reported.
std::optional<std::vector<Param>> read_params(Tokens& tokens, Report& report);

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
  void missing(std::string_view name);
  void finish();

 private:
  struct Given {
    Param param;
    bool taken = false;
  };
  bool is_one(const Param& p, std::size_t numbers, std::size_t texts);
  const Row* row_;
  Span at_;
  std::vector<Given> given_;
  Report* report_;
};

}  // namespace ls::scene::pbrt
