// The parameters of one object. The code that reads the object takes parameters by name; finish() reports
// those that were not taken.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/schema/describe_fields.h"
#include "formats/xml/document.h"

namespace ls::scene {

class Reader;

class Params {
 public:
  Params(Reader& reader, const Element& object);

  const Element& object() const { return object_; }
  std::string title() const;  // for example: bsdf "diffuse"
  bool has(std::string_view name) const;
  // Returns the child of that name (a property, an object or a reference), and marks it as taken. nullptr:
  // there is none. From then on, a message about an unknown parameter may suggest this name.
  const Element* take(std::string_view name);
  // A nested object that was not taken by name. `use` is the element in the parent: the object itself, or a
  // reference to it.
  struct Nested {
    const Element* object;
    const Element* use;
  };
  enum class Names { any, none };  // which objects to take: all, or only those without a name
  std::vector<Nested> take_nested(std::string_view tag, Names names = Names::any);
  // Returns the only nested object with this tag; nullopt if there is none. A second one is reported as
  // "{owner} has a second {kind}".
  std::optional<Nested> take_only(std::string_view tag, std::string_view owner, std::string_view kind);
  // Reports the parameters that were not taken.
  void finish();

  // Each function returns the value of a parameter that is a string or a transform. nullopt: the parameter is
  // absent, or it has another type, which is reported.
  std::optional<std::string> take_string(std::string_view name);
  std::optional<Transform> take_transform(std::string_view name);
  // As take(), but only of an <animation>.
  const Element* take_animation(std::string_view name);

  // Reads the parameter into `value`. If the parameter is not given, uses the field's fallback, or reports an
  // error if the field is required.
  template <class T>
  void read(const Field& f, T& value) {
    if (const Element* e = take(f.name))
      convert(f, *e, value);
    else
      absent(f, value);
  }
  // Each reads `value` from `e`, in the notation of the value's type, and reports errors.
  void convert(const Field& f, const Element& e, double& value);
  void convert(const Field& f, const Element& e, int& value);
  void convert(const Field& f, const Element& e, bool& value);
  void convert(const Field& f, const Element& e, std::uint64_t& value);
  void convert(const Field& f, const Element& e, std::string& value);
  void convert(const Field& f, const Element& e, Vec3& value);
  void convert(const Field& f, const Element& e, Rgb& value);
  void convert(const Field& f, const Element& e, std::vector<double>& value);
  void convert(const Field& f, const Element& e, Transform& value);
  void convert(const Field& f, const Element& e, UvTransform& value);
  void convert(const Field& f, const Element& e, AssetIndex& value);
  void convert(const Field& f, const Element& e, TextureIndex& value);
  void convert(const Field& f, const Element& e, VolumeIndex& value);
  template <class Tag>
  requires(std::is_same_v<Tag, TextureTag> ||
           std::is_same_v<Tag, VolumeTag>) void convert(const Field& f, const Element& e,
                                                        std::optional<Index<Tag>>& value) {
    convert(f, e, value.emplace());
  }
  template <class E>
  requires std::is_enum_v<E>
  void convert(const Field& f, const Element& e, E& value) {
    const auto text = string_value(f.name, e);
    if (!text) return;
    std::vector<std::string> names;
    for (const auto& [name, named] : NamesOf<E>::all) {
      if (name == *text) {
        value = named;
        return;
      }
      names.emplace_back(name);
    }
    if (const auto other = also_named<E>(*text)) {
      value = *other;
      return;
    }
    not_one_of(f.name, e, *text, names);
  }

  void absent(const Field& f, TextureIndex& value);
  void absent(const Field& f, VolumeIndex& value);
  template <class T>
  void absent(const Field& f, T&) {
    if (f.required) missing(f.name);
  }

 private:
  struct Child {
    const Element* element;
    // The nested object; for a reference, the object that it refers to (nullptr until the reference is
    // resolved). nullptr for plain values.
    const Element* object = nullptr;
    std::string_view name;
    bool taken = false;
  };
  void left_over(const Child& c);
  void missing(std::string_view name);
  void wrong_type(std::string_view name, const Element& e, std::string_view wanted);
  void not_one_of(std::string_view name, const Element& e, const std::string& given,
                  const std::vector<std::string>& names);
  bool in_range(const Field& f, const Element& e, double x);
  bool in_range(const Field& f, const Element& e, const std::array<double, 3>& x);
  // Returns the object at `e`, nested or referenced. Returns nullptr if `e` is a plain value, or is wrong,
  // which is reported.
  const Element* object_at(const Element& e);
  std::optional<std::string> string_value(std::string_view name, const Element& e);
  std::optional<Rgb> colour(const Field& f, const Element& e, std::string_view wanted);
  std::optional<Rgb> spectrum(const Field& f, const Element& e, std::string_view wanted);
  std::optional<Rgb> colour_of_object(const Field& f, const Element& e, const Element& object);
  Rgb shown(const Field& f, const Element& e, const Rgb& seen);

  Reader& reader_;
  const Element& object_;
  std::vector<Child> children_;
  std::vector<std::string> known_;
  const Element* warned_of_ = nullptr;  // the element whose roughness of 0 was told last
};

// Reads the fields of an object from its parameters. describe() (core/scene/schema) lists the fields of
// each type and calls field() for each.
class Binder {
 public:
  explicit Binder(Params& params) : params_(params) {}
  template <class T>
  void field(const Field& f, T& value) {
    if (f.derived) return;
    if constexpr (requires(Params & p, const Element& e) { p.convert(f, e, value); }) params_.read(f, value);
  }

 private:
  Params& params_;
};

// Reads all fields that describe() lists for T. The caller may take further parameters before
// params.finish().
template <class T>
void bind(Params& params, T& value) {
  Binder binder(params);
  describe(binder, value);
}

}  // namespace ls::scene
