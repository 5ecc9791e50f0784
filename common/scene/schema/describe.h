// The table of the scene language. For every type of scene.h it has the name, and for every field the name,
// unit, range, default (the value in a default-constructed struct, or Field::fallback for textures) and
// meaning. Parameter reading, canonical JSON, hashing, docs/reference/scene-format.md and the random tests
// all visit it:
//
//   describe(visitor, value)  calls  visitor.field(Field{...}, value.member)  for each member.
//
// CONTRIBUTING.md lists the further steps for a new type.
#pragma once

#include <array>
#include <concepts>
#include <limits>
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
  // True for fields that were added when scenes already had digests, or that Mitsuba does not have. If such a
  // field has its type's initial value (false, 0, empty), it is written neither in files nor in JSON, so it
  // may be missing there.
  bool elided = false;
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

#define LS_TYPE(type, ...)                        \
  template <>                                     \
  struct InfoOf<type> {                           \
    static constexpr TypeInfo value{__VA_ARGS__}; \
  };

LS_TYPE(ConstantTexture, "texture", "constant", "uniform, srgb",
        "one colour; also written as a plain `<rgb>`, `<float>` or `<spectrum>`")
LS_TYPE(BitmapTexture, "texture", "bitmap", "",
        "an image: PNG, JPEG, BMP, EXR or HDR; (u, v) = (0, 0) is its upper left corner")
LS_TYPE(CheckerboardTexture, "texture", "checkerboard", "", "two colours in alternation")
LS_TYPE(PeakTexture, "texture", "peak", "",
        "the largest channel of another texture, or its colour divided by that; not in Mitsuba: Nori's "
        "`microfacet_tex` is made of it")
LS_TYPE(ProductTexture, "texture", "product", "",
        "the product of two textures, or where that is large enough; not in Mitsuba: factors and cut-outs of "
        "glTF are made of it")
LS_TYPE(
    MeshAttributeTexture, "texture", "mesh_attribute", "",
    "what a `ply` mesh carries at its vertices, interpolated over each triangle, or at its faces: one "
    "number or three. Its properties `r g b` or `red green blue` (maybe with an `alpha`, left out) are the "
    "attribute `color`; one or three of a kind like `foo_x foo_y foo_z`, `foo_0 foo_1 foo_2` or `foo_1 "
    "foo_2 foo_3` are `foo`; `foo_r foo_g foo_b` are `foo_color`. As in Mitsuba 3.9, floats count as they "
    "are, `uchar` from 0 to 255 (so give `scale` = 1/255), and other whole numbers as sRGB codes")
LS_TYPE(DiffuseBsdf, "bsdf", "diffuse", "", "ideally rough surface, one-sided unless wrapped in `twosided`")
LS_TYPE(ConductorBsdf, "bsdf", "conductor", "", "smooth metal")
LS_TYPE(RoughConductorBsdf, "bsdf", "roughconductor", "",
        "rough metal; `alpha` sets both alpha_u and alpha_v")
LS_TYPE(DielectricBsdf, "bsdf", "dielectric", "", "smooth boundary of glass, water or the like")
LS_TYPE(RoughDielectricBsdf, "bsdf", "roughdielectric", "",
        "rough boundary of glass, water or the like; `alpha` sets both alpha_u and alpha_v. Indices within a "
        "thousandth of each other, or a roughness below one, make it a `dielectric`")
LS_TYPE(ThinDielectricBsdf, "bsdf", "thindielectric", "",
        "a sheet of glass as one surface, reflections within the sheet included: light passes straight on, "
        "which counts as no scattering")
LS_TYPE(PlasticBsdf, "bsdf", "plastic", "", "diffuse base under a smooth dielectric coat")
LS_TYPE(RoughPlasticBsdf, "bsdf", "roughplastic", "", "diffuse base under a rough dielectric coat")
LS_TYPE(NullBsdf, "bsdf", "null", "", "index-matched boundary of a medium: light passes unchanged")
LS_TYPE(TwoSidedBsdf, "bsdf", "twosided", "",
        "gives each side of a surface a bsdf; one nested bsdf serves both")
LS_TYPE(MaskBsdf, "bsdf", "mask", "",
        "lets a share of the light pass straight on, shadows included; that counts as no scattering, and an "
        "emitter on the surface is not masked")
LS_TYPE(BlendBsdf, "bsdf", "blendbsdf", "", "a mixture of two bsdfs")
LS_TYPE(NormalMapBsdf, "bsdf", "normalmap", "",
        "turns the normal that a bsdf sees by an image (`raw` as a rule); light that the turned and the true "
        "normal put on different sides is left out")
LS_TYPE(BumpMapBsdf, "bsdf", "bumpmap", "",
        "turns the normal that a bsdf sees as if the surface were lifted by the luminance of an image, its "
        "`texture` (`raw` as a rule; bilinear, or else it is flat), which may also carry another name or "
        "none; light that the turned and the true normal put on different sides is left out")
LS_TYPE(PrincipledBsdf, "bsdf", "principled", "",
        "Burley's model of metals, coated dielectrics and glass. `specular` instead of `eta` means "
        "eta = 2 / (1 - sqrt(0.08 specular)) - 1")
LS_TYPE(ConstVolume, "volume", "constvolume", "",
        "one value: as the density of a `heterogeneous` medium in [0, 1]^3, moved by `to_world`; everywhere "
        "as its albedo or emission, or in a `homogeneous` medium; also written as a plain `<rgb>` or "
        "`<float>`")
LS_TYPE(GridVolume, "volume", "gridvolume", "", "values on a grid, from a file")
LS_TYPE(IsotropicPhase, "phase", "isotropic", "",
        "scatters equally into all directions; what a medium has if none is given")
LS_TYPE(HgPhase, "phase", "hg", "", "Henyey-Greenstein")
LS_TYPE(HomogeneousMedium, "medium", "homogeneous", "", "the same everywhere")
LS_TYPE(HeterogeneousMedium, "medium", "heterogeneous", "", "varies in space by volumes")
LS_TYPE(RectangleShape, "shape", "rectangle", "", "[-1, 1]^2 in the plane z = 0, normal +z")
LS_TYPE(CubeShape, "shape", "cube", "", "[-1, 1]^3, normals outwards")
LS_TYPE(SphereShape, "shape", "sphere", "",
        "a ball's surface; `center` and `radius` act before `to_world`, which may not stretch it")
LS_TYPE(DiskShape, "shape", "disk", "", "unit disk in the plane z = 0, normal +z")
LS_TYPE(MeshShape, "shape", "mesh", "obj, ply, serialized", "triangles from a file")
LS_TYPE(
    CylinderShape, "shape", "cylinder", "",
    "an open cylinder about the line from `p0` to `p1`, normals outwards; `to_world` may stretch it along "
    "that line only")
LS_TYPE(ShapeGroup, "shape", "shapegroup", "",
        "shapes that are seen where an `instance` of the group stands, and kept in memory once; they stand "
        "inside, placed within the group by their own `to_world`. Shapes that emit light, and instances, "
        "can't be in a group")
LS_TYPE(Instance, "shape", "instance", "",
        "a `shapegroup` once more: a `<ref>` to it, or the group itself, stands inside")
LS_TYPE(AreaEmitter, "emitter", "area", "",
        "light from the front of the shape that it stands in. `cutoff_angle`, `beam_width` and `falloff` are "
        "our own: they make each point of it a spot light, whose radiance between the two angles is "
        "multiplied by s^falloff, s = (cos a - cos cutoff_angle) / (cos beam_width - cos cutoff_angle)")
LS_TYPE(ConstantEmitter, "emitter", "constant", "", "the same radiance from everywhere around")
LS_TYPE(DirectionalEmitter, "emitter", "directional", "",
        "parallel light from far away; a `to_world` instead of `direction` turns +z. `angular_radius` is our "
        "own: with it the light is a disk in the sky, seen by paths that leave the scene, whose radiance is "
        "irradiance / (pi sin^2 angular_radius)")
LS_TYPE(PointEmitter, "emitter", "point", "",
        "light from a point; a `to_world` instead of `position` moves the origin")
LS_TYPE(SpotEmitter, "emitter", "spot", "",
        "light from a point into a cone around the +z of `to_world`, falling off linearly in the angle")
LS_TYPE(
    EnvmapEmitter, "emitter", "envmap", "",
    "light from everywhere around by an image in latitude-longitude form (EXR or HDR; PNG and JPEG, too). "
    "Before `to_world` its top row is +y and its bottom row -y; of the horizon the left edge is -z, a "
    "quarter of the width further +x, the middle +z, three quarters -x, as in Mitsuba 3. It takes 2 x 3 "
    "to 2^25 pixels (8192 x 4096); negative values become 0")
LS_TYPE(ProjectorEmitter, "emitter", "projector", "",
        "throws an image from the origin along the +z of `to_world`, +y up: a `perspective` camera turned "
        "round, with the image's shape for a film. A plane one unit ahead receives pi times scale times the "
        "image, as in Mitsuba 3")
LS_TYPE(BoxFilter, "rfilter", "box", "", "each sample counts in its own pixel")
LS_TYPE(TentFilter, "rfilter", "tent", "", "falls off linearly")
LS_TYPE(GaussianFilter, "rfilter", "gaussian", "", "Gaussian, cut at four standard deviations")
LS_TYPE(Sensor, "sensor", "perspective", "perspective, thinlens, orthographic, spherical",
        "looks along the +z of `to_world`, +y up, +x to the left. `orthographic`: parallel rays from a sheet "
        "of 2 by 2 height / width, which `to_world` may scale. `spherical`: all directions by latitude and "
        "longitude, +y in the top row; of the horizon the left edge is -z, a quarter of the width further +x")
LS_TYPE(FilmSettings, "film", "hdrfilm", "", "size of the frame and its reconstruction filter")
LS_TYPE(IntegratorSettings, "integrator", "volpath", "volpath, volpath_distant_mis, path, whitted",
        "how light is followed. `path` and `whitted` leave media out. `whitted` is Nori's: what mirrors and "
        "clear glass show, however many, and where they lead to on any other surface the light that comes "
        "straight from lamps; light that such surfaces send each other, and what mirrors throw on them, is "
        "left out")
#undef LS_TYPE

template <class Variant>
struct KindsOf;
template <class... Kinds>
struct KindsOf<std::variant<Kinds...>> {
  static constexpr std::array<std::string_view, sizeof...(Kinds)> names{kInfo<Kinds>.name...};
};
// Returns the names of the kinds of a variant, such as Medium, in its order.
template <class Variant>
inline constexpr auto& kKindsOf = KindsOf<Variant>::names;

template <class T, class U>
concept Of = std::same_as<std::remove_const_t<T>, U>;

// Returns the enumerators of an enumeration with their names.
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
