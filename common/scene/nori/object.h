// One object of a Nori file during translation to Mitsuba. Its parameters are taken by name and checked
// against the table of parameters; parameters that are not taken are reported.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/schema/nori_words.h"
#include "common/scene/xml/document.h"
#include "common/scene/xml/error_report.h"
#include "common/scene/xml/make_element.h"

namespace ls::scene::nori {

enum class Kind { object, property, transform, step, unknown };
Kind object_kind(const Element& e);
// Checks elements, their attributes and nesting; false if errors were reported.
bool check_objects(const Element& root, Report& report);

// Returns the table's row for the type of `e`. If the type is unknown or unsupported, reports this and
// returns nullptr; for an unknown type the message has a suggestion.
const Plugin* known_plugin(const Element& e, Report& report);

class Object {
 public:
  Object(const Element& e, const Plugin& plugin, Report& report);

  const Element& element() const { return e_; }
  std::string title() const;  // for example: bsdf "microfacet"
  std::string_view type() const { return plugin_.type; }
  bool has(std::string_view parameter) const;

  // Returns the element that sets the parameter. nullptr: there is none, or it is wrong, which is reported.
  const Element* take(std::string_view parameter);
  double number(std::string_view parameter, double fallback);
  Rgb color(std::string_view parameter, const Rgb& fallback);
  Vec3 triple(std::string_view parameter, const Vec3& fallback);
  std::string_view text(std::string_view parameter, std::string_view fallback);
  void missing(std::string_view parameter);
  // True if both parameters are given; this is reported as an error.
  bool both(std::string_view one, std::string_view other);

  // Returns the nested objects with this tag, except those that are values of parameters.
  std::vector<const Element*> nested(std::string_view tag);
  // Returns the nested object with this tag, or nullptr if there is none; a second one is reported.
  const Element* only(std::string_view tag);
  void finish();
  // Replaces finish() for an object of an unsupported type: reports only parameters that this type does not
  // have.
  void finish_refused();

 private:
  struct Child {
    const Element* e;
    bool taken = false;
  };
  bool fits(const Parameter& p, const Element& e);
  bool in_range(const Parameter& p, const Element& e, const std::vector<double>& values);
  bool knows(std::string_view parameter) const;
  void left_over(const Child& c);

  const Element& e_;
  const Plugin& plugin_;
  Report& report_;
  std::vector<Child> children_;
};

}  // namespace ls::scene::nori
