#include "formats/reader/mitsuba_plugins.h"

#include <algorithm>

#include "core/scene/schema/describe_fields.h"

namespace ls::scene {
namespace {

constexpr Standing kRead = Standing::read, kInPart = Standing::in_part, kRefused = Standing::refused;
constexpr Origin kOlder = Origin::older, kOurs = Origin::ours;

constexpr std::string_view kPolarised =
    "polarisation is not supported; leave it out, or write the unpolarised surface";
constexpr std::string_view kNotLight =
    "it does not render light; request an AOV instead (`--aov`, or the integrator \"aov\")";
constexpr std::string_view kOneMethod = "with a warning: another method, the same image";
constexpr std::string_view kCountOnly = "only `sample_count` is read; Lightshaft chooses the sampler";
constexpr std::string_view kNegativeLobes =
    "`gaussian`, with a warning: filters with negative lobes are not supported";
constexpr std::string_view kCurves = "curves are not supported; write them as meshes in a \"ply\"";
constexpr std::string_view kSplats = "volumetric splats are not supported; write the surface as a mesh";
constexpr std::string_view kSky =
    "sky models are not supported; save the sky's image in Mitsuba and use it as an \"envmap\", with a "
    "\"directional\" of an `angular_radius` for the sun";
constexpr std::string_view kPhase =
    "phase functions that depend on a direction of the medium are not supported; use an \"hg\" or a "
    "\"tabphase\" of the same mean cosine";
constexpr std::string_view kMeasured =
    "measured materials are not supported; fit a \"roughconductor\" or a \"principled\" to it";
constexpr std::string_view kBakeTexture = "bake it into a \"bitmap\"";
constexpr std::string_view kAsHdrfilm = "with a warning, like hdrfilm: the image has linear colours";
constexpr std::string_view kConvertMesh = "write it as a mesh in a \"ply\"";

constexpr PluginRow kPlugins[] = {
    {"shape", "bsplinecurve", kRefused, kCurves},
    {"shape", "cube", kRead, ""},
    {"shape", "cylinder", kInPart, "`to_world` may stretch it along its axis only"},
    {"shape", "disk", kRead, ""},
    {"shape", "ellipsoids", kRefused, kSplats},
    {"shape", "ellipsoidsmesh", kRefused, kSplats},
    {"shape", "instance", kRead, ""},
    {"shape", "linearcurve", kRefused, kCurves},
    {"shape", "merge", kRead, "its shapes become separate shapes, which look the same"},
    {"shape", "obj", kRead, ""},
    {"shape", "ply", kRead, ""},
    {"shape", "rectangle", kRead, ""},
    {"shape", "sdfgrid", kRefused,
     "surfaces of distance fields are not supported; write them as a mesh in a \"ply\""},
    {"shape", "serialized", kRead, ""},
    {"shape", "shapegroup", kRead, ""},
    {"shape", "sphere", kRead, ""},
    {"shape", "blender", kRefused,
     "it refers to data in Blender's memory; use Lightshaft's add-on for Blender"},
    {"shape", "deformable", kRefused,
     "meshes that deform while the shutter is open are not rendered; write one mesh for each frame", kOlder},
    {"shape", "hair", kRefused, kCurves, kOlder},
    {"shape", "heightfield", kRefused, kConvertMesh, kOlder},

    {"bsdf", "blendbsdf", kRead, ""},
    {"bsdf", "bumpmap", kInPart, "its texture must be a \"bitmap\""},
    {"bsdf", "circular", kRefused, kPolarised},
    {"bsdf", "conductor", kInPart,
     "`eta` and `k` are colours without textures; some names of metals are not known"},
    {"bsdf", "dielectric", kRead, ""},
    {"bsdf", "diffuse", kRead, ""},
    {"bsdf", "hair", kRefused, "hair is not supported; write strands as meshes with a \"roughplastic\""},
    {"bsdf", "mask", kRead, ""},
    {"bsdf", "measured", kRefused, kMeasured},
    {"bsdf", "measured_polarized", kRefused, kMeasured},
    {"bsdf", "normalmap", kRead, ""},
    {"bsdf", "null", kRead, ""},
    {"bsdf", "plastic", kRead, ""},
    {"bsdf", "polarizer", kRefused, kPolarised},
    {"bsdf", "pplastic", kRefused, "polarisation is not supported; use \"plastic\" or \"roughplastic\""},
    {"bsdf", "principled", kRead, ""},
    {"bsdf", "principledthin", kRefused,
     "use a \"blendbsdf\" of \"roughthindielectric\" for its spec_trans and \"diffusetransmission\" for its "
     "diff_trans"},
    {"bsdf", "retarder", kRefused, kPolarised},
    {"bsdf", "roughconductor", kInPart,
     "`eta` and `k` are colours without textures; some names of metals are not known"},
    {"bsdf", "roughdielectric", kRead, ""},
    {"bsdf", "roughplastic", kRead, ""},
    {"bsdf", "thindielectric", kRead, ""},
    {"bsdf", "twosided", kInPart,
     "not with `allow_transmission`: surfaces that light passes already have two sides"},
    {"bsdf", "coating", kRefused,
     "use \"plastic\", \"coatedconductor\", or a \"principled\" with a clearcoat", kOlder},
    {"bsdf", "difftrans", kRead, "a `diffusetransmission` that reflects nothing", kOlder},
    {"bsdf", "hk", kRefused, "put a medium into the shape instead", kOlder},
    {"bsdf", "irawan", kRefused, "woven cloth is not supported; use a \"principled\" with sheen", kOlder},
    {"bsdf", "mixturebsdf", kRefused, "write it as nested \"blendbsdf\"", kOlder},
    {"bsdf", "phong", kRefused, "write it as a \"blendbsdf\" of a \"diffuse\" and a \"roughconductor\"",
     kOlder},
    {"bsdf", "roughcoating", kRefused,
     "use \"roughplastic\", \"coatedconductor\", or a \"principled\" with a clearcoat", kOlder},
    {"bsdf", "roughdiffuse", kRefused, "use \"diffuse\"", kOlder},
    {"bsdf", "ward", kRefused, "use a \"roughconductor\" with alpha_u and alpha_v", kOlder},

    {"texture", "bitmap", kInPart, "from files; for arrays in Python use the package `lightshaft`"},
    {"texture", "checkerboard", kRead, ""},
    {"texture", "mesh_attribute", kInPart, "only for \"ply\" meshes"},
    {"texture", "rawconstant", kInPart, "values must not be below 0"},
    {"texture", "srgb", kRead, ""},
    {"texture", "uniform", kRead, ""},
    {"texture", "volume", kRefused,
     "only textures in u and v are supported; bake it into a \"bitmap\" or into vertex colours of a \"ply\""},
    {"texture", "curvature", kRefused, kBakeTexture, kOlder},
    {"texture", "gridtexture", kRefused, kBakeTexture, kOlder},
    {"texture", "sampledspectrum", kRefused, "write it as a \"regular\" spectrum", kOlder},
    {"texture", "scale", kRefused, "multiply the image or the colours in advance", kOlder},
    {"texture", "vertexcolors", kRefused, "write it as a \"mesh_attribute\" of a \"ply\"", kOlder},
    {"texture", "wireframe", kRefused, kBakeTexture, kOlder},

    {"spectrum", "blackbody", kInPart,
     "only for lights: the radiance of Mitsuba's spectral modes, with colours outside of sRGB cut off at 0; "
     "Mitsuba's RGB modes refuse it"},
    {"spectrum", "d65", kRead, "`color` (1 if not given) times `scale`, as in Mitsuba's RGB modes"},
    {"spectrum", "irregular", kRead,
     "like a `<spectrum value=...>` of these pairs, as in Mitsuba's RGB modes"},
    {"spectrum", "rawconstant", kInPart, "values must not be below 0"},
    {"spectrum", "regular", kRead, "like a `<spectrum value=...>` of these pairs, as in Mitsuba's RGB modes"},
    {"spectrum", "srgb", kRead, ""},
    {"spectrum", "uniform", kRead, ""},

    {"emitter", "area", kRead, ""},
    {"emitter", "constant", kRead, ""},
    {"emitter", "directional", kRead, ""},
    {"emitter", "directionalarea", kRefused,
     "area lights of a single direction are not supported; give an \"area\" a small `cutoff_angle`, or use a "
     "\"directional\""},
    {"emitter", "envmap", kInPart, "from files; for arrays in Python use the package `lightshaft`"},
    {"emitter", "point", kRead, ""},
    {"emitter", "projector", kRead, ""},
    {"emitter", "spot", kRead, ""},
    {"emitter", "sunsky", kRefused, kSky},
    {"emitter", "timed_sunsky", kRefused, kSky},
    {"emitter", "avg_sunsky", kRefused, kSky, kOlder},
    {"emitter", "collimated", kRefused, "use a \"spot\" of a small cutoff_angle, or a \"directional\"",
     kOlder},
    {"emitter", "sky", kRefused, kSky, kOlder},
    {"emitter", "sun", kRefused, "use a \"directional\" of an `angular_radius`", kOlder},

    {"medium", "heterogeneous", kRead, ""},
    {"medium", "homogeneous", kRead, ""},

    {"phase", "blendphase", kRead, ""},
    {"phase", "hg", kRead, ""},
    {"phase", "isotropic", kRead, ""},
    {"phase", "rayleigh", kRead, ""},
    {"phase", "sggx", kRefused, kPhase},
    {"phase", "tabphase", kRead, ""},
    {"phase", "kkay", kRefused, kPhase, kOlder},
    {"phase", "microflake", kRefused, kPhase, kOlder},
    {"phase", "mixturephase", kRefused, "write it as a \"blendphase\", nested for more than two", kOlder},

    {"volume", "constvolume", kRead, ""},
    {"volume", "gridvolume", kInPart, "from files; for arrays in Python use the package `lightshaft`"},
    {"volume", "hgridvolume", kRefused, "write it as one \"gridvolume\"; a `.vdb` may be sparse", kOlder},
    {"volume", "volcache", kRefused, "replace it by the volume inside it", kOlder},

    {"integrator", "aov", kInPart,
     "its integrator, and the channels that Lightshaft has as AOVs; others are refused by name"},
    {"integrator", "depth", kRefused, kNotLight},
    {"integrator", "direct", kRead, "`path` with max_depth 2"},
    {"integrator", "direct_projective", kRead, "`path` with max_depth 2, with a warning"},
    {"integrator", "moment", kInPart, "its integrator, with a warning: the variances are not written"},
    {"integrator", "path", kRead, ""},
    {"integrator", "prb", kRead, "`path`, with a warning; max_depth is 6 unless given"},
    {"integrator", "prb_basic", kRead, "`path`, with a warning; max_depth is 6 unless given"},
    {"integrator", "prb_projective", kRead, "`path`, with a warning; max_depth is 6 unless given"},
    {"integrator", "prbvolpath", kRead, "`volpath`, with a warning; max_depth is 6 unless given"},
    {"integrator", "ptracer", kRead, "`path`"},
    {"integrator", "stokes", kRefused, "polarisation is not supported; use the integrator inside it"},
    {"integrator", "volpath", kRead, ""},
    {"integrator", "volpathmis", kRead, "`volpath`"},
    {"integrator", "volprim_rf_basic", kRefused, kSplats},
    {"integrator", "adaptive", kInPart, "its integrator, with a warning: --target-error decides the samples",
     kOlder},
    {"integrator", "ao", kRefused, kNotLight, kOlder},
    {"integrator", "bdpt", kRead, kOneMethod, kOlder},
    {"integrator", "erpt", kRead, kOneMethod, kOlder},
    {"integrator", "field", kRefused, kNotLight, kOlder},
    {"integrator", "irrcache", kInPart, "its integrator, with a warning: nothing is interpolated", kOlder},
    {"integrator", "mlt", kRead, kOneMethod, kOlder},
    {"integrator", "multichannel", kRefused, "use the integrator \"aov\"", kOlder},
    {"integrator", "photonmapper", kRead, kOneMethod, kOlder},
    {"integrator", "ppm", kRead, kOneMethod, kOlder},
    {"integrator", "prb_reparam", kRefused, "write \"prb\" or \"path\"", kOlder},
    {"integrator", "pssmlt", kRead, kOneMethod, kOlder},
    {"integrator", "sppm", kRead, kOneMethod, kOlder},
    {"integrator", "volpath_simple", kRead, "`volpath`", kOlder},
    {"integrator", "vpl", kRead, kOneMethod, kOlder},
    {"integrator", "volpath_distant_mis", kRead, "", kOurs},
    {"integrator", "whitted", kRead, "Nori's", kOurs},

    {"sensor", "batch", kInPart, "of meters; a job has one image, so submit the scene once for each camera"},
    {"sensor", "distant", kRefused,
     "it measures light that leaves the scene; use an \"orthographic\", whose image is that light"},
    {"sensor", "flat_sensor", kRefused,
     "it is meant for optimising scenes in Mitsuba; use a \"perspective\""},
    {"sensor", "irradiancemeter", kRead, ""},
    {"sensor", "orthographic", kRead, ""},
    {"sensor", "perspective", kRead, ""},
    {"sensor", "radiancemeter", kRead, ""},
    {"sensor", "thinlens", kRead, ""},
    {"sensor", "fluencemeter", kRead, "the integral over all directions: 4 pi times the mean radiance",
     kOlder},
    {"sensor", "fluxmeter", kRead, "", kOurs},
    {"sensor", "perspective_rdist", kRefused, "lens distortion is not supported; use a \"perspective\"",
     kOlder},
    {"sensor", "spherical", kRead, "", kOlder},
    {"sensor", "telecentric", kRefused, "use an \"orthographic\"", kOlder},

    {"film", "hdrfilm", kInPart, "size, crop and filter; the command line or the job chooses the format"},
    {"film", "specfilm", kRefused, "spectral rendering is not supported; use \"hdrfilm\""},
    {"film", "ldrfilm", kInPart, kAsHdrfilm, kOlder},
    {"film", "mfilm", kInPart, kAsHdrfilm, kOlder},
    {"film", "tiledhdrfilm", kInPart, kAsHdrfilm, kOlder},

    {"sampler", "independent", kInPart, kCountOnly},
    {"sampler", "ldsampler", kInPart, kCountOnly},
    {"sampler", "multijitter", kInPart, kCountOnly},
    {"sampler", "orthogonal", kInPart, kCountOnly},
    {"sampler", "stratified", kInPart, kCountOnly},
    {"sampler", "halton", kInPart, kCountOnly, kOlder},
    {"sampler", "hammersley", kInPart, kCountOnly, kOlder},
    {"sampler", "sobol", kInPart, kCountOnly, kOlder},

    {"rfilter", "box", kRead, ""},
    {"rfilter", "catmullrom", kInPart, kNegativeLobes},
    {"rfilter", "gaussian", kRead, ""},
    {"rfilter", "lanczos", kInPart, kNegativeLobes},
    {"rfilter", "mitchell", kInPart, kNegativeLobes},
    {"rfilter", "tent", kRead, ""},
};

bool has_row(const std::vector<PluginRow>& rows, std::string_view tag, std::string_view name) {
  return std::ranges::any_of(rows, [&](const PluginRow& r) { return r.tag == tag && r.name == name; });
}

// Adds a row for each alternative of the variant (a kind of object) that Mitsuba does not have. The row is
// inserted after the rows with the same tag.
template <class... Kinds>
void add_ours(std::vector<PluginRow>& rows, std::type_identity<std::variant<Kinds...>>) {
  for (const TypeInfo& kind : {kInfo<Kinds>...}) {
    // A kind with a list `plugins` is read under the names in this list only. All of these are Mitsuba's, so
    // they have rows already.
    if (!kind.plugins.empty() || has_row(rows, kind.kind, kind.name)) continue;
    const auto last =
        std::find_if(rows.rbegin(), rows.rend(), [&](const PluginRow& r) { return r.tag == kind.kind; });
    rows.insert(last.base(), {kind.kind, kind.name, kRead, "", kOurs});
  }
}

const std::vector<PluginRow>& all_rows() {
  static const std::vector<PluginRow> all = [] {
    std::vector<PluginRow> rows(std::begin(kPlugins), std::end(kPlugins));
    add_ours(rows, std::type_identity<Geometry>{});
    add_ours(rows, std::type_identity<Bsdf>{});
    add_ours(rows, std::type_identity<Texture>{});
    add_ours(rows, std::type_identity<Emitter>{});
    add_ours(rows, std::type_identity<Medium>{});
    add_ours(rows, std::type_identity<Phase>{});
    add_ours(rows, std::type_identity<Volume>{});
    return rows;
  }();
  return all;
}

}  // namespace

std::span<const PluginRow> mitsuba_plugins() { return all_rows(); }

const PluginRow* plugin_row(std::string_view tag, std::string_view name) {
  const auto& rows = all_rows();
  const auto row =
      std::ranges::find_if(rows, [&](const PluginRow& r) { return r.tag == tag && r.name == name; });
  return row == rows.end() ? nullptr : &*row;
}

bool is_read_plugin(std::string_view tag, std::string_view name) {
  const PluginRow* row = plugin_row(tag, name);
  return row && row->standing != Standing::refused;
}

bool is_our_parameter(std::string_view tag, std::string_view plugin, std::string_view parameter) {
  struct Ours {
    std::string_view tag, plugin;  // empty: all plugins of the tag
    std::vector<std::string_view> parameters;
  };
  static const std::vector<Ours> all = {
      {"shape",
       "",
       {"flat_without_normals", "visible_camera", "holdout", "shadow_catcher", "visible_shadow",
        "visible_reflection", "visible_volume", "link_sets"}},
      {"shape", "obj", {"shape_index"}},
      {"shape", "ply", {"shape_index"}},
      {"bsdf", "", {"multiple_scattering"}},
      {"bsdf", "normalmap", {"follow_mirroring"}},
      {"texture", "bitmap", {"channel", "color_space"}},
      {"emitter", "area", {"cutoff_angle", "beam_width", "falloff", "two_sided"}},
      {"emitter",
       "",
       {"visible_camera", "visible_reflection", "visible_volume", "light_group", "receivers", "blockers"}},
      {"emitter", "directional", {"angular_radius"}},
      {"emitter", "envmap", {"mapping", "color_space"}},
      {"emitter", "projector", {"as_intensity"}},
      {"medium",
       "",
       {"tint", "emission", "source_radiance", "temperature", "emission_scale", "temperature_scale",
        "temperature_offset", "peak_one", "emission_weight", "priority", "light_group", "link_sets"}},
      {"phase", "tabphase", {"red", "green", "blue", "nodes", "angles"}},
      {"volume", "gridvolume", {"grid_name", "node_centred", "border", "order"}},
      {"sensor", "", {"aperture_scale", "points", "filename"}},
      {"sensor", "perspective", {"aperture_radius", "focus_distance"}},
      {"sensor", "thinlens", {"principal_point_offset_x", "principal_point_offset_y"}},
      {"film", "hdrfilm", {"transparent"}},
      {"rfilter", "box", {"radius"}},
      {"integrator",
       "",
       {"phase_only", "camera_points", "light_vertices", "equiangular", "lamp_flights", "light_tree",
        "path_reuse", "shadow_roulette", "sky_samples", "sky_portals", "local_lights", "emissive_grids",
        "path_splitting"}},
  };
  return std::ranges::any_of(all, [&](const Ours& row) {
    return row.tag == tag && (row.plugin.empty() || row.plugin == plugin) &&
           std::ranges::find(row.parameters, parameter) != row.parameters.end();
  });
}

std::vector<std::string> read_plugins(std::string_view tag) {
  std::vector<std::string> names;
  for (const PluginRow& row : all_rows())
    if (row.tag == tag && row.standing != Standing::refused) names.emplace_back(row.name);
  return names;
}

}  // namespace ls::scene
