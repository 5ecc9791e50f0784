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
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

#include "common/scene/limits.h"
#include "common/scene/scene.h"

namespace ls::scene {

struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool open_min = false, open_max = false;
  bool contains(double x) const { return (open_min ? x > min : x >= min) && (open_max ? x < max : x <= max); }
};
// Returns "0 < NAME <= 1", for example.
inline std::string range_text(std::string_view name, const Range& r) {
  const std::string low = std::isinf(r.min) ? "" : fmt::format("{} {} ", r.min, r.open_min ? "<" : "<=");
  const std::string high = std::isinf(r.max) ? "" : fmt::format(" {} {}", r.open_max ? "<" : "<=", r.max);
  return fmt::format("{}{}{}", low, name, high);
}
inline constexpr Range kAny{};
inline constexpr Range kNonNegative{.min = 0};
inline constexpr Range kPositive{.min = 0, .open_min = true};
inline constexpr Range kUnit{.min = 0, .max = 1};

struct Field {
  std::string_view name;
  std::string_view doc;
  std::string_view unit = "";
  Range range = kAny;        // range of a number, or of each component of a colour
  Rgb fallback{1, 1, 1};     // colour that replaces a missing texture or volume
  bool derived = false;      // true: derived from other parts of the file; not a parameter
  bool named_ior = false;    // true: names of materials ("water") are accepted too
  bool constvolume = false;  // true: a colour that may be given as a <volume type="constvolume">
  bool required = false;
  // The type's name in the documentation, if the C++ type does not suffice: "point", "medium" (a nested one
  // with the field's name), "<phase>" (a nested one without a name). Derived fields without such a name are
  // not written in files.
  std::string_view given_as = "";
  // For a number or colour that Mitsuba does not have: the value for which the field is not written in files.
  double unwritten = std::numeric_limits<double>::quiet_NaN();
  bool number = false;  // true: a texture that is read as a scalar, not as a colour
  // True for fields that Mitsuba does not have or that older scenes lack. Such a field is written neither in
  // files nor in JSON while it has its default, so scenes without it keep their files and digests. The
  // default is `unwritten` for a colour that sets it, otherwise the type's initial value (false, 0, empty).
  bool elided = false;
  // The integrators that have this parameter: all of them if both names are empty, one if only the second is
  // empty.
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
    return value == T{};
  }
};

struct TypeInfo {
  std::string_view kind;     // the element's tag: bsdf, shape, ...
  std::string_view name;     // name of the plugin, and "type" in JSON
  std::string_view plugins;  // Mitsuba's plugins that are read as this type, if their names differ
  std::string_view doc;
};

template <class T>
struct InfoOf;  // without a definition, so that a type without a row in the table does not compile
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
// The names of the kinds of a variant, such as Medium, in its order.
template <class Variant>
inline constexpr auto& kKindsOf = KindsOf<Variant>::names;

// Calls f.template operator()<Kind>() for the kind of `Variant` with this name. Returns false if there is
// none.
template <class Variant, class F>
bool with_kind_named(std::string_view name, F f) {
  return [&]<class... Kinds>(std::type_identity<std::variant<Kinds...>>) {
    return ((name == kInfo<Kinds>.name && (f.template operator()<Kinds>(), true)) || ...);
  }(std::type_identity<Variant>{});
}

template <class T, class U>
concept Of = std::same_as<std::remove_const_t<T>, U>;

// NamesOf<E>::all has the enumerators of the enumeration E with their names.
template <class E>
struct Named {
  std::string_view name;
  E value;
};
template <class E>
struct NamesOf;
template <>
struct NamesOf<TextureFilter> {
  static constexpr Named<TextureFilter> all[] = {{"nearest", TextureFilter::nearest},
                                                 {"bilinear", TextureFilter::bilinear}};
};
template <>
struct NamesOf<Wrap> {
  static constexpr Named<Wrap> all[] = {
      {"repeat", Wrap::repeat}, {"mirror", Wrap::mirror}, {"clamp", Wrap::clamp}};
};
template <>
struct NamesOf<Channel> {
  static constexpr Named<Channel> all[] = {{"all", Channel::all},
                                           {"red", Channel::red},
                                           {"green", Channel::green},
                                           {"blue", Channel::blue},
                                           {"alpha", Channel::alpha}};
};
template <>
struct NamesOf<Microfacet> {
  static constexpr Named<Microfacet> all[] = {{"beckmann", Microfacet::beckmann}, {"ggx", Microfacet::ggx}};
};
template <>
struct NamesOf<VolumeFilter> {
  static constexpr Named<VolumeFilter> all[] = {{"nearest", VolumeFilter::nearest},
                                                {"trilinear", VolumeFilter::trilinear}};
};
template <>
struct NamesOf<GridOrder> {
  static constexpr Named<GridOrder> all[] = {{"x_fastest", GridOrder::x_fastest},
                                             {"z_fastest", GridOrder::z_fastest}};
};
template <>
struct NamesOf<MeshFormat> {
  static constexpr Named<MeshFormat> all[] = {
      {"obj", MeshFormat::obj}, {"ply", MeshFormat::ply}, {"serialized", MeshFormat::serialized}};
};
template <>
struct NamesOf<Projection> {
  static constexpr Named<Projection> all[] = {{"perspective", Projection::perspective},
                                              {"orthographic", Projection::orthographic},
                                              {"spherical", Projection::spherical}};
};
template <>
struct NamesOf<FovAxis> {
  static constexpr Named<FovAxis> all[] = {{"x", FovAxis::x},
                                           {"y", FovAxis::y},
                                           {"diagonal", FovAxis::diagonal},
                                           {"smaller", FovAxis::smaller},
                                           {"larger", FovAxis::larger}};
};
template <>
struct NamesOf<SkyMapping> {
  static constexpr Named<SkyMapping> all[] = {{"latlong", SkyMapping::latlong},
                                              {"equal_area", SkyMapping::equal_area}};
};
template <>
struct NamesOf<DistanceSampling> {
  static constexpr Named<DistanceSampling> all[] = {{"exponential", DistanceSampling::exponential},
                                                    {"equiangular", DistanceSampling::equiangular},
                                                    {"mis", DistanceSampling::mis}};
};
template <>
struct NamesOf<MisHeuristic> {
  static constexpr Named<MisHeuristic> all[] = {{"power", MisHeuristic::power},
                                                {"balance", MisHeuristic::balance}};
};

}  // namespace ls::scene
