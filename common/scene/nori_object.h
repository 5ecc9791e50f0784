// One object of a Nori file while it is put into Mitsuba's words: its parameters are taken by name, checked
// against the table of words; what nobody took is reported.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/document.h"
#include "common/scene/nori_words.h"
#include "common/scene/report.h"

namespace ls::scene::nori {

enum class Kind { object, property, transform, step, unknown };
Kind kind_of(const Element& e);
// Which elements there are, what attributes they have, what may stand in what; false: reported.
bool check_structure(const Element& root, Report& report);

// Reports a type that there is not, with a suggestion, or that is refused; nullptr then.
const Plugin* known_plugin(const Element& e, Report& report);

class Object {
 public:
  Object(const Element& e, const Plugin& plugin, Report& report);

  const Element& element() const { return e_; }
  std::string title() const;  // bsdf "microfacet"
  std::string_view type() const { return plugin_.type; }
  bool has(std::string_view parameter) const;

  // The element that gives it; nullptr if there is none, or it was wrong (and reported).
  const Element* take(std::string_view parameter);
  double number(std::string_view parameter, double fallback);
  Rgb color(std::string_view parameter, const Rgb& fallback);
  Vec3 triple(std::string_view parameter, const Vec3& fallback);
  std::string_view text(std::string_view parameter, std::string_view fallback);
  void missing(std::string_view parameter);
  // Both given; reported.
  bool both(std::string_view one, std::string_view other);

  // Nested objects of this tag that no parameter has.
  std::vector<const Element*> nested(std::string_view tag);
  const Element* only(std::string_view tag);  // a second one is reported
  void finish();
  // Of an object that was refused: only what is unknown.
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

// ---- elements in Mitsuba's words
// A new one stands where the one stands that it comes of.
Element made(std::string tag, std::string_view type, const Span& at);
void set(Element& e, std::string attribute, std::string value, const Span& at);
void add(Element& parent, Element child);
// A property; of numbers in the shortest form that reads back to the same bits.
void add(Element& parent, std::string tag, std::string name, std::string value, const Span& at);
void add(Element& parent, std::string name, double value, const Span& at);
void add(Element& parent, std::string name, const Rgb& value, const Span& at);
// The same property by another name.
void add_as(Element& parent, const Element* property, std::string name);
// <transform>, with these steps before its own; nothing if there is neither.
void add_transform(Element& parent, const Element* transform, std::string name,
                   std::vector<Element> before = {});
Element matrix_step(const std::array<double, 16>& m, const Span& at);

}  // namespace ls::scene::nori
