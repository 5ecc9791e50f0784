#include "common/scene/gltf/support_table.h"

#include <algorithm>
#include <iterator>

namespace ls::scene::gltf {
namespace {

constexpr Use kRead = Use::read, kIgnored = Use::ignored, kRefused = Use::refused;

constexpr Row kObjects[] = {
    {"asset", "version, minVersion", kRead, "version 2 only"},
    {"scene, scenes", "nodes", kRead, "the scene `scene`, or else the first; without scenes all nodes"},
    {"nodes", "matrix, translation, rotation, scale, children", kRead,
     "`to_world`; a node stands once, at most 256 deep. What is flattened to nothing is left out with a "
     "warning"},
    {"nodes", "mesh", kRead,
     "shapes; a mesh of several nodes is a `shapegroup` with instances, but for its parts that give light"},
    {"nodes", "skin", kRead,
     "corners are carried by their joints, and the mesh is a file of its own each time"},
    {"nodes", "weights", kRead, "of the mesh's morph targets, at most 4096, before the mesh's own `weights`"},
    {"nodes", "camera", kRead, "the sensor: the first, or the one that `-D camera=NAME` names"},
    {"meshes", "primitives: mode", kRead,
     "triangles, strips and fans; points and lines are left out with a warning"},
    {"meshes", "primitives: POSITION, NORMAL, indices", kRead,
     "a file `.ply` of its own; without NORMAL the triangles are flat"},
    {"meshes", "primitives: TEXCOORD_n", kRead,
     "one set a mesh, that of the material's textures; a warning if they differ"},
    {"meshes", "primitives: COLOR_0", kRead, "multiplies the base colour, and with alphaMode the opacity"},
    {"meshes", "primitives: TANGENT", kIgnored, "tangents follow from the texture coordinates"},
    {"meshes", "primitives: targets", kRead,
     "POSITION and NORMAL, times their weights; what else they change is a warning"},
    {"meshes", "primitives: JOINTS_n, WEIGHTS_n", kRead,
     "up to 8 sets; the weights of a corner are scaled to 1"},
    {"skins", "joints, inverseBindMatrices", kRead, "all joints stand in the scene"},
    {"accessors", "all", kRead,
     "every componentType, normalized or not, any byteStride, sparse; numbers that are not finite are an "
     "error"},
    {"buffers", "uri", kRead, "a file, or base64 in the text; at most 32 MiB each and 64 MiB together"},
    {"images", "uri, bufferView", kRead, "PNG and JPEG; those in a buffer become files of their own"},
    {"samplers", "wrapS, wrapT", kRead, "`wrap_mode`, which is wrapS for both; a warning if they differ"},
    {"samplers", "magFilter, minFilter", kRead, "NEAREST of magFilter is `nearest`, all else `bilinear`"},
    {"materials", "baseColorFactor, baseColorTexture", kRead, "the colour; its alpha is for alphaMode"},
    {"materials", "metallicFactor, roughnessFactor, metallicRoughnessTexture", kRead,
     "metallic from blue, roughness from green"},
    {"materials", "normalTexture", kRead, "`normalmap`; a `scale` other than 1 is a warning"},
    {"materials", "occlusionTexture", kIgnored, "light is followed instead"},
    {"materials", "emissiveFactor, emissiveTexture", kRead, "an `area` emitter on the front of the surface"},
    {"materials", "alphaMode, alphaCutoff", kRead,
     "MASK and BLEND are a `mask`: cut at alphaCutoff, or a share of the light"},
    {"materials", "doubleSided", kIgnored,
     "surfaces are seen from both sides; only emission is on the front"},
    {"cameras", "perspective", kRead,
     "`yfov`; the frame is 720 pixels high and as wide as aspectRatio says (1280 without); clipped at znear "
     "and zfar"},
    {"cameras", "orthographic", kRead, "`xmag`, `ymag`"},
    {"animations", "channels, samplers", kRead,
     "translation, rotation, scale and weights at the second of `-D time` or of a frame: STEP, LINEAR and "
     "CUBICSPLINE; before the first and after the last time their values. Without a second nodes stand as "
     "they say themselves, with a warning"},
};

constexpr Row kExtensions[] = {
    {"", "EXT_mesh_gpu_instancing", kRead, "instances by TRANSLATION, ROTATION, SCALE"},
    {"", "EXT_meshopt_compression", kRefused, "unpack the file, as by `gltf-transform copy IN OUT`"},
    {"", "EXT_texture_avif", kRefused, "convert the images to PNG or JPEG"},
    {"", "EXT_texture_webp", kRefused, "convert the images to PNG or JPEG"},
    {"", "KHR_animation_pointer", kIgnored, "what it moves stands still"},
    {"", "KHR_draco_mesh_compression", kRefused, "unpack the file, as by `gltf-transform copy IN OUT`"},
    {"", "KHR_lights_punctual", kRead,
     "`directional`, `point` and `spot`; a `range` has no effect, as light has none"},
    {"", "KHR_materials_anisotropy", kIgnored, "highlights are round"},
    {"", "KHR_materials_clearcoat", kRead,
     "the coat of `principled`, a quarter as bright and at most of roughness 0.32; a warning says so"},
    {"", "KHR_materials_diffuse_transmission", kIgnored, "surfaces let no light through diffusely"},
    {"", "KHR_materials_dispersion", kIgnored, "colours are all bent alike"},
    {"", "KHR_materials_emissive_strength", kRead, "multiplies the emission"},
    {"", "KHR_materials_ior", kRead, "the index of refraction, at least 1"},
    {"", "KHR_materials_iridescence", kIgnored, "thin films are not known"},
    {"", "KHR_materials_pbrSpecularGlossiness", kRefused,
     "convert the materials to metallic-roughness, as by `gltf-transform metalrough IN OUT`"},
    {"", "KHR_materials_sheen", kIgnored, "Burley's sheen is another: cloth has none"},
    {"", "KHR_materials_specular", kRead,
     "specularFactor and the largest channel of specularColorFactor scale the reflection straight on; "
     "textures have no effect, which is a warning"},
    {"", "KHR_materials_transmission", kRead,
     "with a volume a body of glass; without one a sheet, `thindielectric`, or `roughthindielectric` where "
     "it is rough"},
    {"", "KHR_materials_unlit", kRead, "the base colour shines, and nothing is reflected"},
    {"", "KHR_materials_variants", kIgnored, "the material that a primitive names itself is taken"},
    {"", "KHR_materials_volume", kRead,
     "with a thicknessFactor above 0: within is a `homogeneous` medium that absorbs; thickness itself has no "
     "effect"},
    {"", "KHR_mesh_quantization", kRead, "as any accessor"},
    {"", "KHR_meshopt_compression", kRefused, "unpack the file, as by `gltf-transform copy IN OUT`"},
    {"", "KHR_node_visibility", kRead, "what is not visible is left out, but its joints carry skins"},
    {"", "KHR_texture_basisu", kRefused, "convert the images from KTX2 to PNG or JPEG"},
    {"", "KHR_texture_transform", kRead, "`to_uv`"},
    {"", "KHR_xmp_json_ld", kIgnored, "it describes the file"},
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
