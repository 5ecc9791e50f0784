// JSON as a tree of values with their places in the text. Errors name the place and the path of a value, such
// as "materials[3].normalTexture".
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

#include "formats/xml/source_text.h"

namespace ls::scene::gltf {

struct Member;
struct Value {
  using List = std::vector<Value>;
  // Members of an object, sorted by name for binary search, since there may be a million.
  using Members = std::vector<Member>;
  std::size_t offset = 0;  // place in the text; for a member of an object, the place of its name
  std::variant<std::monostate, bool, double, std::string, List, Members> is;
};
struct Member {
  std::string name;
  Value value;
};

// Parses a JSON text. Adds the text to the report under this name; a diagnostic about it begins with the
// path of the value that it concerns. nullptr: the text is malformed or beyond the limits, which has been
// reported.
std::shared_ptr<const Value> parse_json(std::string name, std::string text, Report& report);

// Returns the path of the innermost value at or before `offset`, such as "materials[3].normalTexture"; ""
// for the root.
std::string path_at(const Value& root, std::size_t offset);

// A value that the file may lack. The functions that read it return the fallback if it is missing, or if it
// has the wrong type, which they report.
class Item {
 public:
  Item(const Value& value, Report& report) : value_(&value), near_(&value), report_(&report) {}

  bool given() const { return value_ != nullptr; }
  // Returns the member of that name. It is not given if the object lacks it, or if this value is itself not
  // given.
  Item operator[](std::string_view name) const;
  Item extension(std::string_view name) const { return (*this)["extensions"][name]; }
  std::vector<Item> list() const;  // returns the values of this list; none if this is not a list
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
  // Returns a whole number from `least` to `most`. nullopt: it is not given, or it is wrong, which is
  // reported.
  std::optional<std::size_t> whole(std::size_t least, std::size_t most) const;
  // Returns the value of the list `all` whose index is this value. The result is not given if this value is
  // not given, or if it is no valid index, which is reported.
  Item in(const Item& all) const;

  Span at() const { return {0, near_->offset, 1}; }
  void error(std::string text) const { report_->error(at(), std::move(text)); }
  std::nullopt_t refuse(std::string text) const { return report_->refuse(at(), std::move(text)); }
  void warning(std::string text) const { report_->warning(at(), std::move(text)); }
  const Value* identity() const { return value_; }

 private:
  Item(const Value* value, const Value* near, Report* report) : value_(value), near_(near), report_(report) {}
  template <class T>
  T read(T fallback, std::string_view wanted) const;
  void read_numbers(std::vector<double>& all) const;

  const Value* value_;
  // The value whose place at() returns: this value, or if it is missing, the nearest object or list around
  // it.
  const Value* near_;
  Report* report_;
};

}  // namespace ls::scene::gltf
