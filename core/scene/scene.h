// The scene as plain data, the result of reading a scene file of any format. It has no pointers and no
// library types; objects refer to each other by typed indices; every file is identified by its digest.
// Semantics are Mitsuba 3's. Lengths are in scene units, angles in degrees (as in the files), colours linear
// RGB. Equal Scenes have the same canonical serialisation and so the same digest.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/scene/scene_shapes.h"
#include "core/scene/scene_values.h"

namespace ls {

// Textures.
enum class TextureFilter { nearest, bilinear };
enum class Wrap { repeat, mirror, clamp };
enum class Channel { all, red, green, blue, alpha };
// The colour space of an image's stored values. automatic: the file's type decides. Values of 8 and 16 bits
// are encoded by the curve of sRGB; others are linear, with the primaries in the file's header or, without
// those, of sRGB. srgb: encoded by the curve of sRGB. rec709 to adobe_linear: linear. The others are encoded:
// g18_rec709 to adobe by a power (1.8, 2.2, 2.4; 563/256 for Adobe RGB (1998)), srgb_ap1 and srgb_p3_d65 by
// the curve of sRGB with other primaries, acescc and acescct by the curves of S-2014-003 and S-2016-001 with
// the primaries AP1.
enum class ImageColours {
  automatic,
  srgb,
  rec709,
  rec2020,
  p3_d65,
  acescg,
  aces2065_1,
  xyz,
  adobe_linear,
  g18_rec709,
  g22_rec709,
  g24_rec709,
  g22_ap1,
  adobe,
  srgb_ap1,
  srgb_p3_d65,
  acescc,
  acescct
};

struct ConstantTexture {
  Rgb value{.5, .5, .5};
  bool operator==(const ConstantTexture&) const = default;
};
// An image as a texture. v = 0 is its top row, as in Mitsuba 3: lookups do not flip v, but OBJ meshes flip
// theirs when they are loaded (MeshShape).
struct BitmapTexture {
  AssetIndex file;
  TextureFilter filter = TextureFilter::bilinear;
  Wrap wrap = Wrap::repeat;
  bool raw = false;  // true: 8- and 16-bit values are not decoded from sRGB, and `colours` has no effect
  UvTransform to_uv;
  // True for a texture that is used as an opacity. Its value is then the image's alpha channel if any pixel
  // of the image has an alpha below 1/2, otherwise the image's colour.
  bool alpha = false;
  // Which channels are looked up. `all`: the colour. A single channel: the texture is grey, and its value is
  // the number stored in this channel, without sRGB decoding; if the image has no alpha channel, alpha is 1.
  Channel channel = Channel::all;
  ImageColours colours = ImageColours::automatic;
  bool operator==(const BitmapTexture&) const = default;
};
// A checkerboard: color0 where floor(2 u') + floor(2 v') is even, otherwise color1 (Mitsuba's
// `checkerboard`). Here (u', v') is (u, v) transformed by to_uv, modulo 1. If the checkerboard is read as a
// scalar (roughness, opacity, weight of a blend, all parameters of `principled` except its colour), color0
// and color1 are swapped, as in Mitsuba 3.9.
struct CheckerboardTexture {
  TextureIndex color0, color1;
  UvTransform to_uv;
  bool operator==(const CheckerboardTexture&) const = default;
};
// The largest channel of another texture or, with `hue`, the colour of that texture divided by its largest
// channel (white where that texture is black). The largest channel times this hue is the other texture
// itself. Mitsuba has no such texture; it is used to express Nori's `microfacet`.
struct PeakTexture {
  TextureIndex texture;
  bool hue = false;
  bool operator==(const PeakTexture&) const = default;
};
// Reads the mesh attribute `name`, which has one or three numbers for each vertex ("vertex_...",
// interpolated) or for each face ("face_..."). Only meshes from PLY files have attributes: this texture is
// rejected on all other shapes (schema/mesh_attributes.h).
struct MeshAttributeTexture {
  std::string name;
  double scale = 1;
  bool operator==(const MeshAttributeTexture&) const = default;
};
// The product of two textures. With a threshold above 0 it is 1 where the product's luminance is at least the
// threshold, otherwise 0. Mitsuba has no such texture; it is used to express the factors and alpha cut-offs
// of glTF.
struct ProductTexture {
  TextureIndex first, second;
  double threshold = 0;
  bool operator==(const ProductTexture&) const = default;
};
using Texture = std::variant<ConstantTexture, BitmapTexture, CheckerboardTexture, PeakTexture,
                             MeshAttributeTexture, ProductTexture>;

// Surfaces.
enum class Microfacet { beckmann, ggx };
// Several rough surfaces below have the option multiple_scattering. If it is true, they include light that is
// scattered several times between microfacets, which the plain microfacet model leaves out
// (docs/design/multiple-scattering.md). The roughness must then be the same along u and v, and, except for
// PrincipledBsdf, a constant.

struct DiffuseBsdf {
  TextureIndex reflectance;
  bool operator==(const DiffuseBsdf&) const = default;
};
// A thin sheet that scatters light ideally on both sides, such as a leaf or paper. At every point reflectance
// + transmittance is at most 1: where the two textures add up to more than 1, both are divided by their sum.
struct DiffuseTransmissionBsdf {
  TextureIndex reflectance, transmittance;
  bool operator==(const DiffuseTransmissionBsdf&) const = default;
};
struct ConductorBsdf {
  Rgb eta{0, 0, 0}, k{1, 1, 1};  // eta = 0, k = 1 reflects everything (Mitsuba's `none`)
  TextureIndex specular_reflectance;
  bool operator==(const ConductorBsdf&) const = default;
};
struct RoughConductorBsdf {
  Microfacet distribution = Microfacet::beckmann;
  TextureIndex alpha_u, alpha_v;
  Rgb eta{0, 0, 0}, k{1, 1, 1};
  TextureIndex specular_reflectance;
  bool multiple_scattering = false;
  bool operator==(const RoughConductorBsdf&) const = default;
};
struct DielectricBsdf {
  double int_ior = 1.5046, ext_ior = 1.000277;
  TextureIndex specular_reflectance, specular_transmittance;
  bool operator==(const DielectricBsdf&) const = default;
};
struct RoughDielectricBsdf {
  Microfacet distribution = Microfacet::beckmann;
  TextureIndex alpha_u, alpha_v;
  double int_ior = 1.5046, ext_ior = 1.000277;
  TextureIndex specular_reflectance, specular_transmittance;
  bool multiple_scattering = false;
  bool operator==(const RoughDielectricBsdf&) const = default;
};
// A thin sheet, such as a window pane, as one surface: light passes through it without changing its
// direction.
struct ThinDielectricBsdf {
  double int_ior = 1.5046, ext_ior = 1.000277;
  TextureIndex specular_reflectance, specular_transmittance;
  bool operator==(const ThinDielectricBsdf&) const = default;
};
// A thin sheet with two rough sides, as one surface. The lobe of transmitted light is the lobe of reflected
// light, mirrored at the plane of the sheet.
struct RoughThinDielectricBsdf {
  Microfacet distribution = Microfacet::beckmann;
  TextureIndex alpha_u, alpha_v;
  double int_ior = 1.5046, ext_ior = 1.000277;
  TextureIndex specular_reflectance, specular_transmittance;
  bool multiple_scattering = false;
  bool operator==(const RoughThinDielectricBsdf&) const = default;
};
struct PlasticBsdf {
  double int_ior = 1.49, ext_ior = 1.000277;
  bool nonlinear = false;
  TextureIndex diffuse_reflectance, specular_reflectance;
  bool operator==(const PlasticBsdf&) const = default;
};
struct RoughPlasticBsdf {
  Microfacet distribution = Microfacet::beckmann;
  double alpha = .1;
  double int_ior = 1.49, ext_ior = 1.000277;
  bool nonlinear = false;
  TextureIndex diffuse_reflectance, specular_reflectance;
  bool multiple_scattering = false;
  bool operator==(const RoughPlasticBsdf&) const = default;
};
struct NullBsdf {  // an index-matched boundary: light passes unchanged
  bool operator==(const NullBsdf&) const = default;
};
struct TwoSidedBsdf {
  BsdfIndex front, back;
  bool operator==(const TwoSidedBsdf&) const = default;
};
// Bsdfs that contain other bsdfs may be nested at most scene::kMaxBsdfNesting deep.
struct MaskBsdf {  // the share 1 - opacity of the light passes straight through
  TextureIndex opacity;
  BsdfIndex bsdf;
  bool operator==(const MaskBsdf&) const = default;
};
struct BlendBsdf {  // the mixture (1 - weight) first + weight second
  TextureIndex weight;
  BsdfIndex first, second;
  bool operator==(const BlendBsdf&) const = default;
};
// Normal and bump maps have two options; with either of them the BSDF is not reciprocal. With
// flip_invalid_normals, a mapped normal that faces away from the viewer is rotated by half a turn about the
// surface's normal (Schuessler et al. 2017). With use_shadowing_function, light is reduced by the shadowing
// function of microfacets that are as steep as the mapped normal (Estevez, Lecocq, Stein 2019).
// The normal is (x, y, z) = 2 (r, g, b) - 1: x along u, z along the surface normal n, and y along the cross
// product of n and u. With follow_mirroring, y is along whichever direction across u points to the top of the
// image, that is, against v. The two differ where the image appears mirrored on the surface.
struct NormalMapBsdf {
  TextureIndex normalmap;
  BsdfIndex bsdf;
  bool flip_invalid_normals = true, use_shadowing_function = true, follow_mirroring = false;
  bool operator==(const NormalMapBsdf&) const = default;
};
// A bump map: the texture's luminance times `scale`, in scene units, displaces the surface along its normal,
// but only the shading normal changes. The texture is a bitmap.
struct BumpMapBsdf {
  TextureIndex texture;
  double scale = 1;
  BsdfIndex bsdf;
  bool flip_invalid_normals = true, use_shadowing_function = true;
  bool operator==(const BumpMapBsdf&) const = default;
};
// Burley's model of 2012 and 2015, as in Mitsuba 3.
struct PrincipledBsdf {
  TextureIndex base_color, roughness, anisotropic, metallic;
  std::optional<TextureIndex> spec_trans;  // nullopt: no light crosses the surface
  double eta = 1.5;
  TextureIndex spec_tint, sheen, sheen_tint, flatness, clearcoat, clearcoat_gloss;
  bool multiple_scattering = false;
  bool operator==(const PrincipledBsdf&) const = default;
};
// A metal with GGX facets under a dielectric coat with GGX facets. eta and k are the metal's index of
// refraction relative to vacuum.
struct CoatedConductorBsdf {
  double int_ior = 1.49, ext_ior = 1.000277;
  double coat_alpha = 0;
  double alpha_u = .1, alpha_v = .1;
  Rgb eta{0, 0, 0}, k{1, 1, 1};
  TextureIndex specular_reflectance;
  bool operator==(const CoatedConductorBsdf&) const = default;
};
using Bsdf = std::variant<DiffuseBsdf, ConductorBsdf, RoughConductorBsdf, DielectricBsdf, RoughDielectricBsdf,
                          ThinDielectricBsdf, PlasticBsdf, RoughPlasticBsdf, NullBsdf, TwoSidedBsdf, MaskBsdf,
                          BlendBsdf, NormalMapBsdf, BumpMapBsdf, PrincipledBsdf, DiffuseTransmissionBsdf,
                          RoughThinDielectricBsdf, CoatedConductorBsdf>;

// Volumes and media.
//
// A volume with the same value everywhere. If it is a medium's density (sigma_t), it fills the unit cube
// [0,1]^3 of its local space, transformed by to_world; for any other purpose it fills all of space.
struct ConstVolume {
  Rgb value{1, 1, 1};
  Transform to_world;
  bool operator==(const ConstVolume&) const = default;
};
enum class VolumeFilter { nearest, trilinear };
enum class GridOrder { x_fastest, z_fastest };
// A grid of values from a file (docs/reference/scene-format.md). The values are at cell centres, except in
// raw `.bin` files, whose outermost values are on the faces of the grid's box. The box is the unit cube
// [0,1]^3 of the local space or, with use_grid_bbox and for `.bin` files, the bounding box given in the file;
// to_world is applied to it. VDB and NanoVDB grids are placed by the transform in their file instead of a
// box, and then by to_world.
struct GridVolume {
  AssetIndex file;
  std::string grid_name;  // name of the grid in a VDB file; empty: the only grid, or "density"
  VolumeFilter filter = VolumeFilter::trilinear;
  Wrap wrap = Wrap::clamp;
  bool use_grid_bbox = false;
  // True: the outermost values are on the faces of the box, as in Mitsuba 0.x. It has no effect on VDB
  // and NanoVDB files.
  bool node_centred = false;
  // True: the outermost voxels are outside the box, which ends at their inner faces; their values are only
  // used for interpolation. Only for a `.vol` file with values at cell centres.
  bool border = false;
  bool raw = true;
  Transform to_world;
  GridOrder order = GridOrder::x_fastest;  // order of the values in a `.bin`
  bool operator==(const GridVolume&) const = default;
};
// The volumes below need no file. Each has one channel, and none of them is below 0.
//
// A value that falls with height: `value` at the ground and below it, and value * exp(-h / height) at the
// height h above it (both in scene units before to_world). It has no end. As the density of a heterogeneous
// medium alone it has flights and transmittances in closed form (worker/render/media/height_fog.h).
struct HeightFogVolume {
  double value = 1;
  double height = 1;                                   // over which the value falls to 1/e
  Vec3 ground_point{0, 0, 0}, ground_normal{0, 1, 0};  // the normal points up; it has any length above 0
  Transform to_world;
  bool operator==(const HeightFogVolume&) const = default;
};
// Noise in octaves (worker/render/media/noise.h): low + (high - low) * (1 + f) / 2, where f is the sum of the
// octaves divided by the sum of their strengths, limited to [-1, 1]; values below 0 are 0. Octave i has the
// strength gain^i and scale * lacunarity^i cells per unit of length, measured before to_world. As a density
// or as emission it fills the box from `min` to `max`, before to_world; for any other purpose it is
// everywhere.
struct NoiseVolume {
  double scale = 1;
  int octaves = 4;
  double lacunarity = 2, gain = .5;
  Vec3 offset{0, 0, 0};  // added to the position [cells of the first octave]
  std::uint64_t seed = 0;
  double low = 0, high = 1;
  Vec3 min{0, 0, 0}, max{1, 1, 1};
  Transform to_world;
  bool operator==(const NoiseVolume&) const = default;
};
// The density of pbrt-v4's medium "cloud" (worker/render/media/cloud.h), 0 to 1. Its box is as of a
// NoiseVolume.
struct CloudVolume {
  double density = 1, wispiness = 1, frequency = 5;
  Vec3 min{0, 0, 0}, max{1, 1, 1};
  Transform to_world;
  bool operator==(const CloudVolume&) const = default;
};
// The product of two volumes. As a density it fills the box of the first of them that has one; beyond its box
// a grid is 0 here.
struct ProductVolume {
  VolumeIndex first, second;
  bool operator==(const ProductVolume&) const = default;
};
// Another volume's value v, mapped: to t = (v - in_low) / (in_high - in_low), limited to [0, 1]; to t^gamma;
// if there are points, to the value there of the curve through them (linear between them, and constant beyond
// the first and the last); and to out_low + (out_high - out_low) * t. It fills the box of the other volume.
struct RemapVolume {
  VolumeIndex volume;
  double in_low = 0, in_high = 1;
  double gamma = 1;
  std::vector<double> positions, values;  // of the curve's points; positions ascend within [0, 1]
  double out_low = 0, out_high = 1;
  bool operator==(const RemapVolume&) const = default;
};
// Volumes that contain others may be nested at most scene::kMaxVolumeNesting deep.
using Volume = std::variant<ConstVolume, GridVolume, HeightFogVolume, NoiseVolume, CloudVolume, ProductVolume,
                            RemapVolume>;

struct IsotropicPhase {
  bool operator==(const IsotropicPhase&) const = default;
};
struct HgPhase {
  double g = .8;  // mean cosine, in (-1, 1)
  bool operator==(const HgPhase&) const = default;
};
struct RayleighPhase {
  bool operator==(const RayleighPhase&) const = default;
};
struct DrainePhase {
  double g = .8, alpha = 1;
  bool operator==(const DrainePhase&) const = default;
};
struct DropletsPhase {   // water droplets
  double diameter = 20;  // micrometres
  bool operator==(const DropletsPhase&) const = default;
};
struct FournierForandPhase {  // particles in water
  double backscatter = .1;    // share of the light scattered by more than 90 degrees
  double ior = 1.33;          // index of refraction of the particles relative to what is around them
  bool operator==(const FournierForandPhase&) const = default;
};
// Values at scattering angles (schema/phase_tables.h says which lists go together). Each colour is scaled to
// an integral of 1. The scattering angle is 0 where light goes straight on.
struct TabulatedPhase {
  std::vector<double> values;            // of all colours; or
  std::vector<double> red, green, blue;  // of each
  // At which the values are: cosines from -1 to 1, or angles in degrees from 0 to 180. Both empty: at cosines
  // evenly from -1 to 1.
  std::vector<double> nodes, angles;
  bool operator==(const TabulatedPhase&) const = default;
};
// Phase functions that contain others may be nested at most scene::kMaxPhaseNesting deep.
struct BlendPhase {  // the mixture (1 - weight) first + weight second
  VolumeIndex weight;
  PhaseIndex first, second;
  bool operator==(const BlendPhase&) const = default;
};
using Phase = std::variant<IsotropicPhase, HgPhase, RayleighPhase, DrainePhase, DropletsPhase,
                           FournierForandPhase, TabulatedPhase, BlendPhase>;

// A medium with a constant extinction sigma_t (per scene unit) and albedo. When the medium is loaded, sigma_s
// = albedo * sigma_t * scale. Emission per length is emission + sigma_a * source_radiance.
struct HomogeneousMedium {
  Rgb sigma_t{1, 1, 1};
  Rgb albedo{.75, .75, .75};
  double scale = 1;
  PhaseIndex phase;
  Rgb emission{0, 0, 0};         // radiance per scene unit, independent of extinction
  Rgb source_radiance{0, 0, 0};  // radiance of an infinitely deep medium without scattering
  int priority = 0;              // where media overlap, only the media of the highest priority exist
  std::string light_group;       // of the light that the medium gives off (Emitter)
  std::string link_sets;         // the names of the link sets that the medium is in (LightLinks)
  bool operator==(const HomogeneousMedium&) const = default;
};
// A medium whose properties vary in space. The extinction is sigma_t * scale * tint. At most one of emission,
// source_radiance and temperature is set.
struct HeterogeneousMedium {
  VolumeIndex sigma_t;
  VolumeIndex albedo;
  double scale = 1;
  Rgb tint{1, 1, 1};  // must be grey if sigma_t is a coloured grid (three channels that differ)
  PhaseIndex phase;
  std::optional<VolumeIndex> emission;         // radiance per scene unit, independent of extinction
  std::optional<VolumeIndex> source_radiance;  // emission per length is sigma_a times this radiance
  // Emission per length is sigma_a times the radiance of a black body at temperature_offset +
  // temperature_scale * value kelvin.
  std::optional<VolumeIndex> temperature;
  double emission_scale = 1;  // factor on the emission, whichever of the three volumes gives it
  double temperature_scale = 1, temperature_offset = 0;
  bool peak_one = false;  // true: the spectrum of a black body is divided by its largest value
  std::optional<VolumeIndex> emission_weight;  // factor on the black-body emission
  int priority = 0;         // where media overlap, only the media of the highest priority exist
  std::string light_group;  // of the light that the medium gives off (Emitter)
  std::string link_sets;    // the names of the link sets that the medium is in (LightLinks)
  bool operator==(const HeterogeneousMedium&) const = default;
};
using Medium = std::variant<HomogeneousMedium, HeterogeneousMedium>;

// Emitters without a shape.
//
// `light_group` is the name of the emitter's light group: the AOV light_groups has the light of each group
// apart. Empty: the emitter is in the group `other`.
//
// Camera rays that leave the scene before they are scattered do not see an emitter whose visible_camera is
// false. Surfaces receive no light from an emitter whose visible_reflection is false, and media none from one
// whose visible_volume is false. `links` says which shapes and media receive its light and which shade it.
struct ConstantEmitter {  // the same radiance from all directions
  Rgb radiance{1, 1, 1};
  bool visible_camera = true;
  std::string light_group;
  bool visible_reflection = true, visible_volume = true;
  LightLinks links;
  bool operator==(const ConstantEmitter&) const = default;
};
// Parallel light. `direction` is the direction in which the light travels, in world space. `irradiance` is
// received by a plane perpendicular to it.
struct DirectionalEmitter {
  Vec3 direction{0, 0, 1};
  Rgb irradiance{1, 1, 1};
  // In degrees. 0: the light is exactly parallel. Otherwise it comes from a disk of this angular radius in
  // the sky, whose radiance is uniform and gives the same irradiance.
  double angular_radius = 0;
  bool visible_camera = true;
  std::string light_group;
  bool visible_reflection = true, visible_volume = true;
  LightLinks links;
  bool operator==(const DirectionalEmitter&) const = default;
};
struct PointEmitter {
  Vec3 position{0, 0, 0};
  Rgb intensity{1, 1, 1};  // W/sr
  std::string light_group;
  bool visible_reflection = true, visible_volume = true;
  LightLinks links;
  bool operator==(const PointEmitter&) const = default;
};
struct SpotEmitter {  // a spot light at the origin of to_world, which emits along its +z axis
  Transform to_world;
  Rgb intensity{1, 1, 1};
  double cutoff_angle = 20;  // degrees from the axis; no light beyond this
  // In degrees from the axis. Within this angle the intensity is full; from there to cutoff_angle it falls
  // linearly with the angle to 0.
  double beam_width = 15;
  std::optional<TextureIndex> texture;  // factor on the intensity, projected along +z as by Mitsuba
  std::string light_group;
  bool visible_reflection = true, visible_volume = true;
  LightLinks links;
  bool operator==(const SpotEmitter&) const = default;
};
// How an environment map's image covers the directions, in the map's own space.
// latlong: the top row is +y; on the horizon the left edge is -z, a quarter further +x, the middle +z
// (Mitsuba 3). The first and last rows are the poles; columns wrap around. equal_area: a square whose texels
// have the same solid angle each (pbrt-v4). Its centre is +z, its corners are -z, the middles of its right
// and its lower edge +x and +y.
enum class SkyMapping { latlong, equal_area };

// Radiance from all directions, given by an image. to_world may only rotate and mirror.
struct EnvmapEmitter {
  AssetIndex file;
  double scale = 1;
  Transform to_world;
  SkyMapping mapping = SkyMapping::latlong;
  bool visible_camera = true;
  std::string light_group;
  ImageColours colours = ImageColours::automatic;
  bool visible_reflection = true, visible_volume = true;
  LightLinks links;
  bool operator==(const EnvmapEmitter&) const = default;
};

// An inverse camera at the origin of to_world, which looks along its +z axis with +y up. It projects an image
// as a camera with this field of view and the image's aspect ratio sees it. On the plane one scene unit
// ahead, the irradiance is pi * scale times the image's value. With `as_intensity`, the radiant intensity in
// a texel's direction is instead scale times the texel's value [W/sr] (pbrt).
struct ProjectorEmitter {
  TextureIndex irradiance;
  double scale = 1;
  Transform to_world;
  double fov = 50;
  FovAxis fov_axis = FovAxis::x;
  bool as_intensity = false;
  std::string light_group;
  bool visible_reflection = true, visible_volume = true;
  LightLinks links;
  bool operator==(const ProjectorEmitter&) const = default;
};
// A light at the origin of to_world, whose intensity is multiplied by an image of all directions: a square in
// Clarberg's equal-area octahedral form (2008). In its own space +z is the middle of the square and -z its
// corners; +x is to the right and +y below. to_world may only move, turn, mirror and scale, and scaling has
// no effect.
struct GoniometricEmitter {
  Transform to_world;
  Rgb intensity{1, 1, 1};  // W/sr where the image is 1
  TextureIndex texture;
  std::string light_group;
  bool visible_reflection = true, visible_volume = true;
  LightLinks links;
  bool operator==(const GoniometricEmitter&) const = default;
};
using Emitter = std::variant<ConstantEmitter, DirectionalEmitter, PointEmitter, SpotEmitter, EnvmapEmitter,
                             ProjectorEmitter, GoniometricEmitter>;

// The integrator.
//
// The number of pixels that share subpaths if path_reuse (below) is 0 and sharing lowers the error of the
// scene's image.
inline constexpr int kUsualPathReuse = 16;
// Many parameters of IntegratorSettings switch a sampling technique. "Chosen for the scene" means that an
// analysis of the scene decides whether the technique is used.
struct IntegratorSettings {
  // Lightshaft's name of the integrator: "volpath", "volpath_distant_mis", "path" or "whitted".
  std::string name = "volpath";
  int max_depth = -1;  // longest path in segments; -1: no limit; 1: emission only; 2: direct light
  int rr_depth = 5;
  bool hide_emitters = false;
  // `distance` and `heuristic` are for "volpath_distant_mis" only.
  DistanceSampling distance = DistanceSampling::mis;
  MisHeuristic heuristic = MisHeuristic::power;
  // For "volpath" only: number of points on a camera ray's segment through a medium at which next-event
  // estimation samples light. 0: chosen for the scene, possibly none; -1: none.
  int camera_points = 0;
  // For "volpath" only. True: in scenes with media and point, spot or projector lights, no directions are
  // sampled towards these lights, only from phase functions and BSDFs.
  bool phase_only = false;
  // For "volpath" and "path" only: whether paths are connected to points that a directional emitter lights.
  // 0: chosen for the scene; -1: never; 1: always.
  int light_vertices = 0;
  // Both are for "volpath" only; a lamp is a point, spot or projector light. equiangular: whether next-event
  // estimation connects a lamp not only to the vertices of a path but also to points on its segments through
  // media, sampled more densely near the lamp; without this, no directions are sampled towards lamps.
  // lamp_flights: whether a share of the free-flight distances is sampled so that paths scatter near lamps.
  // 0: chosen for the scene; -1: never.
  int equiangular = 0, lamp_flights = 0;
  // How next-event estimation chooses one of many (32 or more) lights. 0: by a tree of lights, from distance,
  // direction and power; -1: by power alone.
  int light_tree = 0;
  // For "volpath" and "path" only: the number of pixels that share their subpaths from the second vertex on.
  // 0: kUsualPathReuse or no sharing, chosen for the scene; -1 or 1: no sharing.
  int path_reuse = 0;
  // For "volpath" only: whether Russian roulette may skip a shadow ray through grids if its contribution can
  // only be small. 0: where this is possible; -1: never, so that all shadow rays are traced.
  int shadow_roulette = 0;
  // For "volpath" and "path" only: whether the first surface of a path samples a second direction towards a
  // constant environment. 0: chosen for the scene; -1: never.
  int sky_samples = 0;
  // For "volpath" and "path" only: whether directions towards the environment (a map or a constant) are also
  // sampled through the openings by which the environment's light enters the scene. 0: chosen for the scene;
  // -1: never; 1: where possible.
  int sky_portals = 0;
  // For "volpath" and "path" only: whether, in a scene with 2 to 64 lights, next-event estimation chooses a
  // light with probabilities that depend on the place and are learned from camera paths. 0: chosen for the
  // scene; -1: never; 1: where possible.
  int local_lights = 0;
  // For "volpath" only: whether next-event estimation also samples directions towards the cells of grids that
  // give off light, such as fire. 0: chosen for the scene; -1: never; 1: where possible.
  int emissive_grids = 0;
  // For "volpath" only, in scenes with grids: whether a path may split at its first scattering, and whether
  // Russian roulette may end a path whose throughput has fallen below its value just after that scattering
  // (worker/render/world/roulette.h). 0: chosen for the scene; -1: neither.
  int path_splitting = 0;
  bool operator==(const IntegratorSettings&) const = default;
};

// The name of a shape or an instance, and the name of the shape's material; used for Cryptomatte only.
struct Label {
  std::string name, material;  // `material` is empty for instances
  bool operator==(const Label&) const = default;
};

struct Scene {
  std::vector<Asset> assets;
  std::vector<Texture> textures;
  std::vector<Bsdf> bsdfs;
  std::vector<Volume> volumes;
  std::vector<Phase> phases;
  std::vector<Medium> media;
  std::vector<Shape> shapes;
  std::vector<Emitter> emitters;
  Sensor sensor;
  FilmSettings film;
  IntegratorSettings integrator;
  std::uint64_t sample_count = 4;
  std::vector<ShapeGroup> groups;
  std::vector<Instance> instances;
  // Names of the AOVs (extra output images, core/image/aov/aov.h) that the scene requests, separated by
  // commas.
  std::string aovs;
  // The labels of all shapes and of all instances, by index; empty unless requested (ReadOptions::labels).
  std::vector<Label> shape_labels, instance_labels;
  std::vector<Meter> meters;  // if there are any, they are measured, and no image is rendered
  bool operator==(const Scene&) const = default;
};

// True if the camera sees of the shape only the shadows on it.
inline bool catches_shadows(const Scene& scene, const Shape& shape) {
  return shape.shadow_catcher && scene.film.transparent && shape.visible_camera;
}

}  // namespace ls
