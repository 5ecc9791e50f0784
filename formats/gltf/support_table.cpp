#include "formats/gltf/support_table.h"

#include <algorithm>
#include <iterator>

namespace ls::scene::gltf {
namespace {

constexpr Use kRead = Use::read, kIgnored = Use::ignored, kRefused = Use::refused;

constexpr Row kObjects[] = {
    {"asset", "version, minVersion", kRead, "version 2 only"},
    {"scene, scenes", "nodes", kRead, "the scene `scene`, or else the first; without scenes all nodes"},
    {"nodes", "matrix, translation, rotation, scale, children", kRead,
     "`to_world`. A node may occur once in the tree, which is at most 256 nodes deep. Nodes whose scale is 0 "
     "are left out with a warning"},
    {"nodes", "mesh", kRead,
     "shapes. A mesh that several nodes use becomes a `shapegroup` with instances, except for its parts that "
     "emit light"},
    {"nodes", "skin", kRead,
     "the vertices follow their joints, and each use of the mesh becomes a file of its own"},
    {"nodes", "weights", kRead,
     "weights of the mesh's morph targets, at most 4096; they override the mesh's own `weights`"},
    {"nodes", "camera", kRead, "the sensor: the first, or the one that `-D camera=NAME` names"},
    {"meshes", "primitives: mode", kRead,
     "triangles, strips and fans; points and lines are left out with a warning"},
    {"meshes", "primitives: POSITION, NORMAL, indices", kRead,
     "each becomes a `.ply` file; without NORMAL the triangles are flat"},
    {"meshes", "primitives: TEXCOORD_n", kRead,
     "one set for each mesh, the one that the material's textures use; a warning if they use several"},
    {"meshes", "primitives: COLOR_0", kRead, "multiplies the base colour, and with alphaMode the opacity"},
    {"meshes", "primitives: TANGENT", kIgnored, "tangents are computed from the texture coordinates"},
    {"meshes", "primitives: targets", kRead,
     "POSITION and NORMAL, times their weights; other attributes cause a warning"},
    {"meshes", "primitives: JOINTS_n, WEIGHTS_n", kRead,
     "up to 8 sets; the weights of a corner are scaled to 1"},
    {"skins", "joints, inverseBindMatrices", kRead, "all joints must be nodes of the scene"},
    {"accessors", "all", kRead,
     "every componentType, normalized or not, any byteStride, sparse; numbers that are not finite are an "
     "error"},
    {"buffers", "uri", kRead, "a file, or base64 in the text; at most 32 MiB each and 64 MiB together"},
    {"images", "uri, bufferView", kRead, "PNG and JPEG; images in a buffer become files"},
    {"samplers", "wrapS, wrapT", kRead, "`wrap_mode`, which is wrapS for both; a warning if they differ"},
    {"samplers", "magFilter, minFilter", kRead, "NEAREST of magFilter is `nearest`, all else `bilinear`"},
    {"materials", "baseColorFactor, baseColorTexture", kRead, "the colour; its alpha is for alphaMode"},
    {"materials", "metallicFactor, roughnessFactor, metallicRoughnessTexture", kRead,
     "metallic from blue, roughness from green"},
    {"materials", "normalTexture", kRead, "`normalmap`; a `scale` other than 1 is a warning"},
    {"materials", "occlusionTexture", kIgnored, "occlusion is rendered, not read from an image"},
    {"materials", "emissiveFactor, emissiveTexture", kRead, "an `area` emitter on the front of the surface"},
    {"materials", "alphaMode, alphaCutoff", kRead,
     "MASK and BLEND are a `mask`: cut at alphaCutoff, or a share of the light"},
    {"materials", "doubleSided", kIgnored,
     "both sides of a surface are visible; only emission is limited to the front"},
    {"cameras", "perspective", kRead,
     "`yfov`; the frame is 720 pixels high and as wide as aspectRatio says (1280 without); clipped at znear "
     "and zfar"},
    {"cameras", "orthographic", kRead, "`xmag`, `ymag`"},
    {"animations", "channels, samplers", kRead,
     "translation, rotation, scale and weights at the time (in seconds) of `-D time` or of a frame, with "
     "STEP, LINEAR and CUBICSPLINE. Before the first and after the last key their values stay. Without a "
     "time the nodes keep their own transforms, with a warning"},
};

constexpr Row kExtensions[] = {
    {"", "EXT_mesh_gpu_instancing", kRead, "instances by TRANSLATION, ROTATION, SCALE"},
    {"", "EXT_meshopt_compression", kRefused, "unpack the file, as by `gltf-transform copy IN OUT`"},
    {"", "EXT_texture_avif", kRefused, "convert the images to PNG or JPEG"},
    {"", "EXT_texture_webp", kRefused, "convert the images to PNG or JPEG"},
    {"", "KHR_animation_pointer", kIgnored, "what it would move stays in place"},
    {"", "KHR_draco_mesh_compression", kRefused, "unpack the file, as by `gltf-transform copy IN OUT`"},
    {"", "KHR_lights_punctual", kRead,
     "`directional`, `point` and `spot`; a `range` has no effect, because light has no limit"},
    {"", "KHR_materials_anisotropy", kIgnored, "highlights are round"},
    {"", "KHR_materials_clearcoat", kRead,
     "the coat of `principled`, a quarter as bright and at most of roughness 0.32; a warning says so"},
    {"", "KHR_materials_diffuse_transmission", kIgnored, "surfaces let no light through diffusely"},
    {"", "KHR_materials_dispersion", kIgnored, "all colours are refracted alike"},
    {"", "KHR_materials_emissive_strength", kRead, "multiplies the emission"},
    {"", "KHR_materials_ior", kRead, "the index of refraction, at least 1"},
    {"", "KHR_materials_iridescence", kIgnored, "thin films are not supported"},
    {"", "KHR_materials_pbrSpecularGlossiness", kRefused,
     "convert the materials to metallic-roughness, as by `gltf-transform metalrough IN OUT`"},
    {"", "KHR_materials_sheen", kIgnored, "the sheen of `principled` is another model, so cloth gets none"},
    {"", "KHR_materials_specular", kRead,
     "specularFactor and the largest channel of specularColorFactor scale the reflection at normal "
     "incidence; textures are ignored with a warning"},
    {"", "KHR_materials_transmission", kRead,
     "with a volume, solid glass; without one, a thin sheet: `thindielectric`, or `roughthindielectric` if "
     "it is rough"},
    {"", "KHR_materials_unlit", kRead, "the base colour is emitted, and nothing is reflected"},
    {"", "KHR_materials_variants", kIgnored, "the primitive's own material is used"},
    {"", "KHR_materials_volume", kRead,
     "with a thicknessFactor above 0, a `homogeneous` medium inside that absorbs; the thickness itself has "
     "no effect"},
    {"", "KHR_mesh_quantization", kRead, "like any accessor"},
    {"", "KHR_meshopt_compression", kRefused, "unpack the file, as by `gltf-transform copy IN OUT`"},
    {"", "KHR_node_visibility", kRead, "invisible nodes are left out, but their joints still move skins"},
    {"", "KHR_texture_basisu", kRefused, "convert the images from KTX2 to PNG or JPEG"},
    {"", "KHR_texture_transform", kRead, "`to_uv`"},
    {"", "KHR_xmp_json_ld", kIgnored, "metadata of the file"},
};

}  // namespace

std::span<const Row> objects() { return kObjects; }
std::span<const Row> extensions() { return kExtensions; }

const Row* find_extension(std::string_view name) {
  const auto* row = std::find_if(std::begin(kExtensions), std::end(kExtensions),
                                 [&](const Row& r) { return r.name == name; });
  return row == std::end(kExtensions) ? nullptr : row;
}

}  // namespace ls::scene::gltf
