// The table of the scene language. It lists every type of scene.h by name, and every field with its name,
// unit, range, default (the value in a default-constructed struct, or Field::fallback for textures) and
// meaning. Parameter reading, canonical JSON, hashing, docs/reference/scene-format.md and the random tests
// all visit it:
//
//   describe(visitor, value)  calls  visitor.field(Field{...}, value.member)  for each member.
//
// The row of a type and its describe() are in the file of the type's family (describe_emitters.h, ...);
// describe_fields.h includes all of them. CONTRIBUTING.md lists the further steps for a new type.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

#include "core/base/check.h"
#include "core/base/light/light_group.h"
#include "core/base/light/link_names.h"
#include "core/scene/limits.h"
#include "core/scene/scene.h"

namespace ls::scene {

struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool open_min = false, open_max = false;
  bool contains(double x) const { return (open_min ? x > min : x >= min) && (open_max ? x < max : x <= max); }
};
// Returns the range as an inequality: "0 < NAME <= 1", for example.
inline std::string range_text(std::string_view name, const Range& r) {
  const std::string low = std::isinf(r.min) ? "" : fmt::format("{} {} ", r.min, r.open_min ? "<" : "<=");
  const std::string high = std::isinf(r.max) ? "" : fmt::format(" {} {}", r.open_max ? "<" : "<=", r.max);
  return fmt::format("{}{}{}", low, name, high);
}
inline constexpr Range kAny{};
inline constexpr Range kNonNegative{.min = 0};
inline constexpr Range kPositive{.min = 0, .open_min = true};
inline constexpr Range kUnit{.min = 0, .max = 1};
inline constexpr Range kMeanCosine{.min = -1, .max = 1, .open_min = true, .open_max = true};
inline constexpr Range kFieldOfView{.min = 0, .max = 180, .open_min = true, .open_max = true};  // degrees

struct Field {
  std::string_view name;
  std::string_view doc;
  std::string_view unit = "";
  Range range = kAny;        // range of a number, or of each component of a colour
  Rgb fallback{1, 1, 1};     // colour that replaces a missing texture or volume
  bool derived = false;      // true: taken from other parts of the file, not from a parameter of this name
  bool named_ior = false;    // true: names of materials ("water") are accepted too
  bool constvolume = false;  // true: this colour may also be given as a <volume type="constvolume">
  bool required = false;
  // How files give the field, where its C++ type does not tell: as a "point"; as a nested object of the named
  // kind that has the field's name ("medium"); or, in angle brackets, as a nested object without a name
  // ("<phase>"). A derived field for which this is empty is not written in files.
  std::string_view given_as = "";
  // For a number or colour that Mitsuba does not have: if the field has this value, it is not written in
  // files. NaN: there is no such value.
  double unwritten = std::numeric_limits<double>::quiet_NaN();
  bool number = false;  // true: the field is a texture that is read as a scalar, not as a colour
  // For a text: returns why a value is wrong, or an empty text. Null: every value is right.
  std::string (*wrong)(std::string_view text) = nullptr;
  // True for fields that Mitsuba does not have or that older scenes lack. If such a field has its default
  // value, it is written neither in files nor in JSON, so that the files and digests of scenes that do not
  // use it stay the same. The default is `unwritten` for a colour or a boolean (0: false, 1: true) whose
  // `unwritten` is a number; for all others it is the type's initial value (false, 0, empty).
  bool elided = false;
  // The names of the one or two integrators that have this parameter; both are empty if all integrators have
  // it.
  std::array<std::string_view, 2> only_of{};

  bool belongs_to(std::string_view integrator) const {
    return only_of[0].empty() || integrator == only_of[0] || integrator == only_of[1];
  }
  // Returns whether this field is written neither in files nor in JSON if it has this value.
  template <class T>
  bool leaves_out(const T& value) const {
    if (!elided) return false;
    if constexpr (std::is_same_v<T, Rgb>)
      if (!std::isnan(unwritten)) return value == Rgb{unwritten, unwritten, unwritten};
    if constexpr (std::is_same_v<T, bool>)
      if (!std::isnan(unwritten)) return value == (unwritten != 0);
    return value == T{};
  }
};

// Returns the field of a nested object. The arguments are members of Field.
inline Field nested_field(std::string_view name, std::string_view doc, std::string_view given_as) {
  return {.name = name, .doc = doc, .derived = true, .given_as = given_as};
}
// Returns the field of a boolean that is true unless given, and that Mitsuba does not have.
inline Field on_unless_given(std::string_view name, std::string_view doc) {
  return {.name = name, .doc = doc, .unwritten = 1, .elided = true};
}
// Describes which vertices receive light from an emitter without a shape.
template <class V, class T>
void describe_receivers(V& v, T& e) {
  v.field(on_unless_given("visible_reflection", "whether surfaces receive its light. Not in Mitsuba"),
          e.visible_reflection);
  v.field(on_unless_given("visible_volume",
                          "whether media receive its light; if not, it makes no shafts. Not in Mitsuba"),
          e.visible_volume);
}
// The field of the light group of an emitter or a medium.
inline constexpr Field kLightGroup{
    .name = "light_group",
    .doc =
        "the light group whose layer of the AOV `light_groups` has this light; letters, digits, `_` and `-`; "
        "if not given, the group is `other`. Not in Mitsuba",
    .wrong = wrong_light_group,
    .elided = true};
// The field of the link sets of a shape or a medium.
inline Field link_sets_field(std::string_view doc) {
  return {.name = "link_sets", .doc = doc, .wrong = wrong_link_sets, .elided = true};
}
// Describes the receivers and blockers of a light.
template <class V, class T>
void describe_links(V& v, T& e) {
  v.field({.name = "receivers",
           .doc = "link sets (`link_sets` of shapes and media) that receive its light: names, separated by "
                  "commas; a `-` before a name takes the set out of the others or, if no name is without a "
                  "`-`, out of everything. Not in Mitsuba",
           .wrong = wrong_link_list,
           .elided = true},
          e.links.receivers);
  v.field({.name = "blockers",
           .doc = "link sets of the shapes that shade its light, as a list like `receivers`; it passes all "
                  "others. Not in Mitsuba",
           .wrong = wrong_link_list,
           .elided = true},
          e.links.blockers);
}
// Returns the field of a texture that is read as a scalar. `fallback` replaces a missing texture.
inline Field number_field(std::string_view name, std::string_view doc, const Range& range, double fallback) {
  return {
      .name = name, .doc = doc, .range = range, .fallback = {fallback, fallback, fallback}, .number = true};
}
inline Field quantity(std::string_view name, std::string_view doc, std::string_view unit,
                      const Range& range) {
  return {.name = name, .doc = doc, .unit = unit, .range = range};
}

inline Field image_colours_field() {
  return {
      .name = "color_space",
      .doc =
          "of the image: `auto` is as the file says (sRGB in 8- and 16-bit files; otherwise linear, with the "
          "primaries in its header), `srgb` is encoded by the curve of sRGB, `rec709` to `lin_adobergb` are "
          "linear, the others are encoded; a white of theirs becomes white. Also the names of these spaces "
          "in the configurations of ACES for OpenColorIO and in MaterialX, such as `ACES - ACEScg`, "
          "`lin_ap1`, "
          "`sRGB - Texture`. No effect on `raw` values. Not in Mitsuba",
      .elided = true};
}

struct TypeInfo {
  std::string_view kind;     // tag of the XML element: bsdf, shape, ...
  std::string_view name;     // name of the plugin, and "type" in JSON
  std::string_view plugins;  // Mitsuba's plugins that are read as this type; empty: the one named `name`
  std::string_view doc;
};

template <class T>
struct InfoOf;  // not defined here, so that code that uses a type without a row in the table does not compile
template <class T>
inline constexpr TypeInfo kInfo = InfoOf<std::remove_const_t<T>>::value;

// Adds the row of a type to the table. The arguments are the members of its TypeInfo.
#define LS_TYPE(type, ...)                        \
  template <>                                     \
  struct InfoOf<type> {                           \
    static constexpr TypeInfo value{__VA_ARGS__}; \
  };

template <class Variant>
struct KindsOf;
template <class... Kinds>
struct KindsOf<std::variant<Kinds...>> {
  static constexpr std::array<std::string_view, sizeof...(Kinds)> names{kInfo<Kinds>.name...};
};
// The names (TypeInfo::name) of the alternatives of a variant such as Medium, in the variant's order.
template <class Variant>
inline constexpr auto& kKindsOf = KindsOf<Variant>::names;

// Calls f.template operator()<Kind>(), where Kind is the alternative of `Variant` whose TypeInfo::name is
// `name`. Returns false, without a call, if no alternative has this name.
template <class Variant, class F>
bool with_kind_named(std::string_view name, F f) {
  return [&]<class... Kinds>(std::type_identity<std::variant<Kinds...>>) {
    return ((name == kInfo<Kinds>.name && (f.template operator()<Kinds>(), true)) || ...);
  }(std::type_identity<Variant>{});
}

template <class T, class U>
concept Of = std::same_as<std::remove_const_t<T>, U>;

// NamesOf<E>::all lists the enumerators of the enumeration E, each with its name in files.
template <class E>
struct Named {
  std::string_view name;
  E value;
};
template <class E>
struct NamesOf;
#define LS_NAMES(type, ...)                             \
  template <>                                           \
  struct NamesOf<type> {                                \
    static constexpr auto all = [] {                    \
      using enum type;                                  \
      return std::to_array<Named<type>>({__VA_ARGS__}); \
    }();                                                \
  };
LS_NAMES(TextureFilter, {"nearest", nearest}, {"bilinear", bilinear})
LS_NAMES(Wrap, {"repeat", repeat}, {"mirror", mirror}, {"clamp", clamp})
LS_NAMES(Channel, {"all", all}, {"red", red}, {"green", green}, {"blue", blue}, {"alpha", alpha})
LS_NAMES(ImageColours, {"auto", automatic}, {"srgb", srgb}, {"rec709", rec709}, {"rec2020", rec2020},
         {"p3-d65", p3_d65}, {"acescg", acescg}, {"aces2065-1", aces2065_1}, {"xyz", xyz},
         {"lin_adobergb", adobe_linear}, {"g18_rec709", g18_rec709}, {"g22_rec709", g22_rec709},
         {"g24_rec709", g24_rec709}, {"g22_ap1", g22_ap1}, {"adobergb", adobe}, {"srgb_ap1", srgb_ap1},
         {"srgb_p3d65", srgb_p3_d65}, {"acescc", acescc}, {"acescct", acescct})
LS_NAMES(Microfacet, {"beckmann", beckmann}, {"ggx", ggx})
LS_NAMES(VolumeFilter, {"nearest", nearest}, {"trilinear", trilinear})
LS_NAMES(GridOrder, {"x_fastest", x_fastest}, {"z_fastest", z_fastest})
LS_NAMES(MeshFormat, {"obj", obj}, {"ply", ply}, {"serialized", serialized})
LS_NAMES(Projection, {"perspective", perspective}, {"orthographic", orthographic}, {"spherical", spherical},
         {"meters", meters})
LS_NAMES(MeterKind, {"radiancemeter", radiance}, {"irradiancemeter", irradiance}, {"fluxmeter", flux},
         {"fluencemeter", fluence})
LS_NAMES(FovAxis, {"x", x}, {"y", y}, {"diagonal", diagonal}, {"smaller", smaller}, {"larger", larger})
LS_NAMES(SkyMapping, {"latlong", latlong}, {"equal_area", equal_area})
LS_NAMES(DistanceSampling, {"exponential", exponential}, {"equiangular", equiangular}, {"mis", mis})
LS_NAMES(MisHeuristic, {"power", power}, {"balance", balance})

// Returns the enumerator that other programs call so. The reader of XML accepts such names; canonical JSON
// has the names of NamesOf alone.
template <class E>
std::optional<E> also_named(std::string_view) {
  return std::nullopt;
}
// The names of colour spaces in the configurations of ACES for OpenColorIO (cg-config 1.0 to 2.1 and ACES
// 1.0.3, with their aliases) and in MaterialX 1.38. Upper and lower case are the same, as in OpenColorIO.
template <>
std::optional<ImageColours> also_named(std::string_view name);

template <class E>
std::string_view name_of(E e) {
  for (const auto& [name, value] : NamesOf<E>::all)
    if (value == e) return name;
  CHECK(false, "an enumerator of value {} has no name", static_cast<int>(e));
  return {};
}

}  // namespace ls::scene
