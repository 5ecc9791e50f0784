// A JSON text as a tree that knows where in the text each value stands, and reading it with errors that have
// that place. Errors say the path of the value, as in "materials[3].normalTexture".
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/scene/xml/error_report.h"

namespace ls::scene::gltf {

struct Member;
struct Value {
  using List = std::vector<Value>;
  using Members = std::vector<Member>;  // by name, as a file may have a million that are asked for often
  std::size_t offset = 0;               // in the text: of a member that of its name
  std::variant<std::monostate, bool, double, std::string, List, Members> is;
};
struct Member {
  std::string name;
  Value value;
};

// Parses a JSON text, and adds it to the report as a file of that name, in whose diagnostics the paths of
// values stand. nullptr: it is malformed or beyond the limits, which has been reported.
std::shared_ptr<const Value> parse_json(std::string name, std::string text, Report& report);

// "materials[3].normalTexture" for the innermost value at or before `offset`; "" for the whole.
std::string path_at(const Value& root, std::size_t offset);

// A value that the file may have or lack. What is wrong with it is reported once it is asked for; then the
// fallback is returned.
class Item {
 public:
  Item(const Value& value, Report& report) : value_(&value), near_(&value), report_(&report) {}

  bool given() const { return value_ != nullptr; }
  // A member of an object; of what is not given, nothing is given.
  Item operator[](std::string_view name) const;
  Item extension(std::string_view name) const { return (*this)["extensions"][name]; }
  std::vector<Item> list() const;  // the values of a list
  bool is_true(bool fallback) const;
  double number(double fallback) const;
  std::string text(std::string_view fallback) const;
  template <std::size_t N>
  std::array<double, N> numbers(std::array<double, N> fallback) const {
    std::vector<double> all(fallback.begin(), fallback.end());
    read_numbers(all);
    std::copy(all.begin(), all.end(), fallback.begin());
    return fallback;
  }
  // A whole number from `least` to `most`; nullopt: it is not given, or it is wrong and reported.
  std::optional<std::size_t> whole(std::size_t least, std::size_t most) const;
  // Returns the value that this index in the list `all` stands for; not given: so is the result.
  Item in(const Item& all) const;

  Span at() const { return {0, near_->offset, 1}; }
  void error(std::string text) const { report_->error(at(), std::move(text)); }
  void warning(std::string text) const { report_->warning(at(), std::move(text)); }
  const Value* identity() const { return value_; }

 private:
  Item(const Value* value, const Value* near, Report* report) : value_(value), near_(near), report_(report) {}
  void read_numbers(std::vector<double>& all) const;

  const Value* value_;
  const Value* near_;  // for the place: the value, or what should have it
  Report* report_;
};

}  // namespace ls::scene::gltf
