#include "formats/nori/words.h"

#include <fmt/format.h>

#include <algorithm>

namespace ls::scene::nori {
namespace {

constexpr unsigned kNumber = kFloat | kInteger;
constexpr unsigned kAnyColor = kColor | kFloat;
constexpr unsigned kTriple = kPoint | kVector;
constexpr Range kRightAngle{.min = 0, .max = 90};  // degrees
constexpr std::string_view kSampling = "it only affects sampling, which Lightshaft chooses itself";
constexpr std::string_view kGaussian = "a Gaussian is used instead";

const Parameter kToWorld{"toWorld", kTransform, "identity", "places it"};
const Parameter kIntIor{"intIOR", kNumber, "1.5046", "index of refraction inside", kPositive};
const Parameter kExtIor{"extIOR", kNumber, "1.000277", "index of refraction outside", kPositive};
const Parameter kAlpha{"alpha", kNumber, "0.1", "roughness (Beckmann)", kPositive};
const Parameter kFilename{"filename", kString, "needed", "the file"};
const Parameter kSampleCount{
    "sampleCount", kInteger, "1", "samples per pixel", {.min = 1, .max = static_cast<double>(kMaxSpp)}};

std::vector<Parameter> camera_parameters() {
  return {
      {"width", kInteger, "1280", "pixels", {.min = 1, .max = kMaxFrameSide}},
      {"height", kInteger, "720", "pixels", {.min = 1, .max = kMaxFrameSide}},
      {"fov", kNumber, "30", "degrees, across the width of the frame", kFieldOfView},
      {"nearClip", kNumber, "0.0001", "nearest visible depth", kPositive},
      {"farClip", kNumber, "10000", "farthest visible depth", kPositive},
      {"apertureRadius", kNumber, "0", "radius of the lens; 0 is a pinhole", kNonNegative},
      {"focusDistance", kNumber, "needed with a lens", "distance of the plane in focus", kPositive},
      {"toWorld", kTransform, "identity",
       "places it; it looks along +z with +y up and +x to the RIGHT, so a bare `<lookat>` shows the world "
       "mirrored and files begin with `<scale value=\"-1,1,1\"/>`"}};
}

std::vector<Parameter> microfacet_parameters(unsigned kd) {
  return {kAlpha, kIntIor, kExtIor, {"kd", kd, "0.5", "albedo of the diffuse base", kUnit}};
}

std::vector<Parameter> metal_parameters(bool rough) {
  std::vector<Parameter> p{
      {"eta", kAnyColor, "needed", "real part of the index of refraction", kNonNegative},
      {"k", kAnyColor, "needed", "imaginary part", kNonNegative},
      {"material", kString, "", "name of a metal, instead of eta and k"},
      {"specular_reflectance", kAnyColor | kTexture, "1", "multiplies the reflected light", kUnit}};
  if (rough) {
    p.push_back(kAlpha);
    p.push_back({"distribution", kString, "beckmann", "or ggx"});
  }
  return p;
}

std::vector<Parameter> medium_parameters(bool grid) {
  std::vector<Parameter> p{
      {"sigma_a", kAnyColor, "0", "absorption per scene unit", kNonNegative},
      {"sigma_s", kAnyColor, "0", "scattering per scene unit", kNonNegative},
      {"absorption", kAnyColor, "0", "another name for sigma_a", kNonNegative},
      {"scattering", kAnyColor, "0", "another name for sigma_s", kNonNegative},
      {"phase_g", kNumber, "0", "mean cosine of Henyey-Greenstein, instead of a `<phase>`", kMeanCosine},
      {"emission", kAnyColor, "0", "radiance per scene unit, whatever the extinction", kNonNegative},
      {"source_radiance", kAnyColor, "0", "emitted light: sigma_a times this", kNonNegative},
      {"scale", kNumber, "1", "multiplies sigma_t", kNonNegative}};
  if (!grid) {
    p.push_back({"sigma_t", kAnyColor, "0.5", "extinction, with albedo instead of sigma_a and sigma_s",
                 kNonNegative});
    p.push_back({"albedo", kAnyColor, "0.5", "sigma_s / sigma_t", kUnit});
    return p;
  }
  p.push_back(
      {"filename", kString, "",
       "grid of densities (`.bin`, `.vol`, `.vdb`) that multiplies sigma_a and sigma_s, placed by its "
       "own box"});
  p.push_back({"order", kString, "x_fastest", "order of the values in a `.bin`; or z_fastest"});
  p.push_back({"density_scale", kNumber, "1", "multiplies the densities", kNonNegative});
  p.push_back({"sigma_t", kVolume | kAnyColor, "", "densities as a `<volume>`, with albedo", kNonNegative});
  p.push_back({"albedo", kVolume | kAnyColor, "0.5", "albedo as a `<volume>` or a colour", kUnit});
  for (const std::string_view name : {"method", "stepSize"})
    p.push_back({name, name == "method" ? unsigned{kString} : kNumber, "", "", kAny, kSampling});
  return p;
}

std::vector<Parameter> parallel_light_parameters() {
  return {{"direction", kTriple, "needed, or toWorld", "direction in which the light travels"},
          {"toWorld", kTransform, "", "instead of direction: rotates +z into it"},
          {"irradiance", kAnyColor, "needed, or radiance", "irradiance of a plane that faces the light",
           kNonNegative},
          {"radiance", kAnyColor, "", "another name for irradiance", kNonNegative},
          {"angularRadius", kNumber, "0", "angular radius in degrees of the disk that the light comes from",
           kRightAngle}};
}

// The parameters of `principled` in Kombu, a descendant of Nori; they mean the same as Mitsuba's.
std::vector<Parameter> principled_parameters() {
  std::vector<Parameter> p{
      {"base_color", kAnyColor | kTexture, "0.5", "the colour", kUnit},
      {"roughness", kNumber | kTexture, "0.5", "alpha of GGX is its square", kUnit},
      {"specular", kNumber, "0.5", "gives the index of refraction, as in Mitsuba", kUnit}};
  for (const std::string_view name : {"anisotropic", "clearcoat", "clearcoat_gloss", "flatness", "metallic",
                                      "sheen", "sheen_tint", "spec_tint", "spec_trans"})
    p.push_back({name, kNumber, "0", "as in Mitsuba", kUnit});
  for (const std::string_view name :
       {"main_specular_sampling_rate", "clearcoat_sampling_rate", "diffuse_reflectance_sampling_rate"})
    p.push_back({name, kNumber, "", "", kAny, kSampling});
  return p;
}

std::vector<Plugin> surfaces() {
  const Parameter albedo{"albedo", kAnyColor | kTexture, "0.5", "the share of light reflected", kUnit};
  return {
      {"bsdf", "diffuse", "`diffuse`", {albedo}},
      {"bsdf", "diffuse_tex", "`diffuse`", {albedo}},
      {"bsdf", "mirror", "`conductor` that reflects everything", {}},
      {"bsdf", "dielectric", "`dielectric`, or `null` if both indices are equal", {kIntIor, kExtIor}},
      {"bsdf", "transparent", "`null`", {}},
      {"bsdf", "null", "`null`", {}},
      {"bsdf", "microfacet",
       "`blendbsdf` of a `diffuse` and a `roughconductor` (eta = intIOR / extIOR, k = 0): kd / pi + (1 - max "
       "kd) D F G / (4 cos cos), which is Nori's model",
       microfacet_parameters(kAnyColor | kTexture)},
      {"bsdf", "microfacet_tex", "as `microfacet`, with a texture in the place of kd",
       microfacet_parameters(kAnyColor | kTexture)},
      {"bsdf", "conductor", "`conductor`", metal_parameters(false)},
      {"bsdf",
       "blendbsdf",
       "`blendbsdf`: (1 - weight) bsdf1 + weight bsdf2",
       {{"weight", kAnyColor | kTexture, "0.5", "weight of bsdf2; for a colour, its luminance", kUnit},
        {"bsdf1", kBsdf, "diffuse, 0.5", "where the weight is 0"},
        {"bsdf2", kBsdf, "diffuse, 0.5", "where the weight is 1"},
        {"fresnel", kBoolean, "false", "only false is supported: the weight may not depend on the angle"}}},
      {"bsdf", "principled", "`principled`", principled_parameters()},
      {"bsdf", "roughconductor", "`roughconductor`", metal_parameters(true)},
      {"texture", "constant_color", "a colour", {{"value", kAnyColor, "0", "the colour", kNonNegative}}},
      {"texture",
       "checkerboard_color",
       "`checkerboard`",
       {{"value1", kAnyColor, "0", "where floor(u / scale - delta) and that of v are both even or both odd",
         kNonNegative},
        {"value2", kAnyColor, "1", "elsewhere", kNonNegative},
        {"scale", kTriple | kNumber, "1", "size of a square in u and v", kPositive},
        {"delta", kTriple | kNumber, "0", "shift, in squares"}}},
      {"texture",
       "imagetexture",
       "`bitmap`. With `filename`, v = 0 is the image's lower edge; with Kombu's `fileName`, v = 0 is its "
       "upper "
       "edge, u runs to the left, and `scale` divides u and v",
       {{"filename", kString, "needed, or fileName", "the image"},
        {"fileName", kString, "", "the image, placed as in Kombu"},
        {"scale", kTriple | kNumber, "1", "with fileName: u / scale, v / scale", kPositive},
        {"srgb", kBoolean, "true", "8- and 16-bit files are sRGB; false: linear"},
        {"wrap", kString, "repeat", "outside the image: repeat, mirror or clamp"},
        {"filter", kString, "bilinear", "between texels: bilinear or nearest"},
        {"boundary", kInteger, "", "", kAny, "images repeat"}}},
  };
}

std::vector<Plugin> lights_and_media() {
  return {
      {"emitter",
       "area",
       "`area`: emits from the front only",
       {{"radiance", kAnyColor, "needed", "radiance", kNonNegative}}},
      {"emitter",
       "point",
       "`point` of intensity power / (4 pi)",
       {{"position", kTriple, "0 0 0", "where it is"},
        {"power", kAnyColor, "needed", "watts", kNonNegative}}},
      {"emitter", "directional", "`directional`", parallel_light_parameters()},
      {"emitter", "distant", "`directional`", parallel_light_parameters()},
      {"emitter",
       "distantdisk",
       "`directional` of irradiance pi radiance sin^2 thetaA, or `constant` at 180",
       {{"radiance", kAnyColor, "needed", "radiance of the disk", kNonNegative},
        {"thetaA",
         kNumber,
         "needed",
         "degrees, its angular radius; at most 90, or 180",
         {.min = 0, .max = 180, .open_min = true}},
        {"toWorld", kTransform, "identity", "rotates +z into the direction of the disk's centre"}}},
      {"emitter", "constant", "`constant`", {{"radiance", kAnyColor, "1", "from everywhere", kNonNegative}}},
      {"emitter",
       "envmap",
       "`envmap`; its top row is +z, its left edge +x, a quarter further +y",
       {kFilename, {"strength", kNumber, "1", "multiplies the image", kNonNegative}, kToWorld}},
      {"emitter",
       "spot",
       "`spot`; in a mesh `area` with the angles as its `cutoff_angle` and `beam_width`",
       {{"position", kTriple, "0 0 0", "where it is; not in a mesh"},
        {"direction", kTriple, "needed", "direction of the light; not in a mesh"},
        {"intensity", kAnyColor, "1", "W/sr on its axis; not in a mesh", kNonNegative},
        {"radiance", kAnyColor, "needed", "radiance along the normal; only in a mesh", kNonNegative},
        {"cutoff",
         kNumber,
         "20",
         "degrees from the axis or the normal: dark beyond",
         {.min = 0, .max = 90, .open_min = true}},
        {"beam_width", kNumber, "3/4 of cutoff", "degrees: full intensity within", kRightAngle},
        {"falloff",
         kNumber,
         "1",
         "exponent of the falloff between the two; only in a mesh",
         {.min = 0, .max = 1000}}}},
      {"medium", "homogeneous", "`homogeneous`", medium_parameters(false)},
      {"medium", "heterogeneous", "`heterogeneous`; `homogeneous` if its volumes are constant",
       medium_parameters(true)},
      {"phase", "isotropic", "`isotropic`", {}},
      {"phase", "hg", "`hg`", {{"g", kNumber, "0", "mean cosine", kMeanCosine}}},
      {"volume", "constvolume", "a constant", {{"value", kAnyColor, "0", "the value", kNonNegative}}},
      {"volume",
       "gridvolume",
       "`gridvolume`. A `.vol` fills the bounding box of its mesh, which must be a sphere, with its "
       "outermost "
       "values on the faces; other files are placed by their own box",
       {kFilename, {"order", kString, "x_fastest", "order of the values in a `.bin`; or z_fastest"}}},
  };
}

std::vector<Plugin> camera_and_shapes() {
  return {
      {"camera", "perspective", "`perspective`, or `thinlens` with an aperture", camera_parameters()},
      {"camera", "thinlens", "`thinlens`", camera_parameters()},
      {"sampler", "independent", "number of samples", {kSampleCount}},
      {"sampler", "stratified", "number of samples, with a warning", {kSampleCount}},
      {"rfilter",
       "gaussian",
       "`gaussian`",
       {{"radius", kNumber, "4 stddev",
         "radius at which it is cut off; values other than 4 stddev cause a warning", kPositive},
        {"stddev", kNumber, "0.5", "pixels", kPositive}}},
      {"rfilter",
       "mitchell",
       "`gaussian`, with a warning: filters with negative lobes are not supported",
       {{"radius", kNumber, "", "", kAny, kGaussian},
        {"B", kNumber, "", "", kAny, kGaussian},
        {"C", kNumber, "", "", kAny, kGaussian}}},
      {"rfilter", "tent", "`tent`", {}},
      {"rfilter", "box", "`box`", {}},
      {"mesh", "obj", "`obj`", {kFilename, kToWorld}},
      {"mesh",
       "sphere",
       "`sphere`",
       {{"center", kTriple, "0 0 0", "middle"}, {"radius", kNumber, "1", "radius", kPositive}, kToWorld}},
  };
}

// Why integrators that show something other than light (normals, ...) are rejected.
constexpr std::string_view kNoLight =
    "it does not render light: choose path_mis, or vol_path_mis if there are media";

constexpr Refused kRefused[] = {
    {"integrator", "normals", kNoLight},
    {"integrator", "av", kNoLight},
    {"integrator", "ao", kNoLight},
    {"integrator", "simple", kNoLight},
    {"integrator", "path_mis_testenvmap", "it is a test of Nori's authors; choose path_mis"},
    {"mesh", "instance",
     "instances of Kombu are not read: its scene, not the file, joins them with their meshes; write the mesh "
     "again where it stands"},
    {"mesh", "reference", "instances of Kombu are not read; write the mesh where it stands"},
    {"mesh", "ref", "instances of Kombu are not read; write the mesh where it stands"},
    {"bsdf", "disneyglass", "its formula is not Burley's; choose principled with spec_trans, or dielectric"},
    {"bsdf", "disney", "its lobes differ between versions of Nori; choose principled, which is Mitsuba's"},
    {"bsdf", "bumpmap",
     "its slopes differ between versions of Nori; write the scene in Mitsuba's language (lightshaft convert) "
     "and put its bumpmap around the bsdf"},
    {"bsdf", "emissive", "put an <emitter type=\"area\"> into the mesh instead"},
    {"emitter", "environment",
     "the direction of its image's edges differs between versions of Nori; write it as an emitter \"envmap\" "
     "with a filename, whose top row is +z"},
    {"emitter", "spotlight",
     "its falloff differs between versions of Nori; write it as an emitter \"spot\", which falls off "
     "linearly in the angle"},
    {"texture", "checkerboard_float", "textures of numbers are not supported; use checkerboard_color"},
    {"texture", "constant_float", "textures of numbers are not supported; write it as a <float>"},
};

}  // namespace

std::string text_of(unsigned types) {
  static constexpr std::pair<unsigned, std::string_view> kTags[] = {
      {kColor, "color"},     {kFloat, "float"},   {kInteger, "integer"}, {kBoolean, "boolean"},
      {kString, "string"},   {kPoint, "point"},   {kVector, "vector"},   {kTransform, "transform"},
      {kTexture, "texture"}, {kVolume, "volume"}, {kBsdf, "bsdf"}};
  // Every parameter that accepts a float also accepts an integer, so <integer> is not named.
  if ((types & kNumber) == kNumber) types &= ~unsigned{kInteger};
  std::string out;
  for (const auto& [type, tag] : kTags)
    if (types & type) out += fmt::format("{}<{}>", out.empty() ? "" : " or ", tag);
  return out;
}

std::span<const Plugin> plugins() {
  static const std::vector<Plugin> all = [] {
    std::vector<Plugin> list = camera_and_shapes();
    for (auto* part : {surfaces, lights_and_media})
      for (Plugin& p : part()) list.push_back(std::move(p));
    return list;
  }();
  return all;
}

const Plugin* find_plugin(std::string_view tag, std::string_view type) {
  const auto all = plugins();
  const auto it =
      std::find_if(all.begin(), all.end(), [&](const Plugin& p) { return p.tag == tag && p.type == type; });
  return it == all.end() ? nullptr : &*it;
}

std::vector<std::string> plugin_names(std::string_view tag) {
  std::vector<std::string> names;
  for (const Plugin& p : plugins())
    if (p.tag == tag) names.emplace_back(p.type);
  if (tag == "integrator")
    for (const IntegratorRow& row : integrators()) names.emplace_back(row.name);
  return names;
}

std::span<const Refused> refused_plugins() { return kRefused; }

std::string_view refused_because(std::string_view tag, std::string_view type) {
  for (const Refused& r : kRefused)
    if (r.tag == tag && r.type == type) return r.because;
  return {};
}

}  // namespace ls::scene::nori
