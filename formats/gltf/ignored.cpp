// Warns of what in a file has no effect: members of objects that glTF 2.0 or the extension does not define
// (most are misspelt), members that are not read, and extensions that are not read.
#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>

#include "core/base/safe_text.h"
#include "core/base/text/suggest.h"
#include "formats/gltf/support_table.h"
#include "formats/gltf/translation.h"

namespace ls::scene::gltf {
namespace {

struct Kind;
// A member of an object. `kind`: of the object that it is, or of each object in the list that it is; null:
// its value has no members of its own that are looked at. `ignored`: why it has no effect; empty: it is read,
// or nothing that is seen depends on it.
struct MemberRule {
  std::string_view name;
  const Kind* kind = nullptr;
  std::string_view ignored = "";
};
struct Kind {
  std::string_view title;
  std::span<const MemberRule> members;
};

constexpr MemberRule kTextureTransformMembers[] = {{"offset"}, {"rotation"}, {"scale"}, {"texCoord"}};
constexpr Kind kTextureTransform{"KHR_texture_transform", kTextureTransformMembers};
constexpr MemberRule kTextureInfoMembers[] = {{"index"}, {"texCoord"}, {"scale"}, {"strength"}};
constexpr Kind kTextureInfo{"a texture", kTextureInfoMembers};
constexpr MemberRule kPbrMembers[] = {{"baseColorFactor"},
                                      {"baseColorTexture", &kTextureInfo},
                                      {"metallicFactor"},
                                      {"roughnessFactor"},
                                      {"metallicRoughnessTexture", &kTextureInfo}};
constexpr Kind kPbr{"pbrMetallicRoughness", kPbrMembers};
constexpr MemberRule kMaterialMembers[] = {{"pbrMetallicRoughness", &kPbr},
                                           {"normalTexture", &kTextureInfo},
                                           {"occlusionTexture", &kTextureInfo},
                                           {"emissiveTexture", &kTextureInfo},
                                           {"emissiveFactor"},
                                           {"alphaMode"},
                                           {"alphaCutoff"},
                                           {"doubleSided"}};
constexpr Kind kMaterial{"a material", kMaterialMembers};
constexpr MemberRule kPrimitiveMembers[] = {{"attributes"}, {"indices"}, {"material"}, {"mode"}, {"targets"}};
constexpr Kind kPrimitive{"a primitive", kPrimitiveMembers};
constexpr MemberRule kMeshMembers[] = {{"primitives", &kPrimitive}, {"weights"}};
constexpr Kind kMesh{"a mesh", kMeshMembers};
constexpr MemberRule kNodeMembers[] = {{"camera"},   {"children"}, {"skin"},        {"matrix"}, {"mesh"},
                                       {"rotation"}, {"scale"},    {"translation"}, {"weights"}};
constexpr Kind kNode{"a node", kNodeMembers};
constexpr MemberRule kSceneMembers[] = {{"nodes"}};
constexpr Kind kScene{"a scene", kSceneMembers};
constexpr MemberRule kPerspectiveMembers[] = {{"aspectRatio"}, {"yfov"}, {"zfar"}, {"znear"}};
constexpr Kind kPerspective{"a perspective camera", kPerspectiveMembers};
constexpr MemberRule kOrthographicMembers[] = {{"xmag"}, {"ymag"}, {"zfar"}, {"znear"}};
constexpr Kind kOrthographic{"an orthographic camera", kOrthographicMembers};
constexpr MemberRule kCameraMembers[] = {
    {"type"}, {"perspective", &kPerspective}, {"orthographic", &kOrthographic}};
constexpr Kind kCamera{"a camera", kCameraMembers};
constexpr MemberRule kTextureMembers[] = {{"sampler"}, {"source"}};
constexpr Kind kTexture{"a texture", kTextureMembers};
constexpr MemberRule kSamplerMembers[] = {{"magFilter"}, {"minFilter"}, {"wrapS"}, {"wrapT"}};
constexpr Kind kSampler{"a sampler", kSamplerMembers};
constexpr MemberRule kImageMembers[] = {{"uri"}, {"mimeType"}, {"bufferView"}};
constexpr Kind kImage{"an image", kImageMembers};
constexpr MemberRule kSkinMembers[] = {{"inverseBindMatrices"}, {"skeleton"}, {"joints"}};
constexpr Kind kSkin{"a skin", kSkinMembers};
constexpr MemberRule kRootMembers[] = {{"asset"},
                                       {"scene"},
                                       {"scenes", &kScene},
                                       {"nodes", &kNode},
                                       {"meshes", &kMesh},
                                       {"accessors"},
                                       {"bufferViews"},
                                       {"buffers"},
                                       {"images", &kImage},
                                       {"textures", &kTexture},
                                       {"samplers", &kSampler},
                                       {"materials", &kMaterial},
                                       {"cameras", &kCamera},
                                       {"skins", &kSkin},
                                       {"animations"},
                                       {"extensionsUsed"},
                                       {"extensionsRequired"}};
constexpr Kind kRoot{"glTF", kRootMembers};

constexpr MemberRule kSpotMembers[] = {{"innerConeAngle"}, {"outerConeAngle"}};
constexpr Kind kSpot{"a spot", kSpotMembers};
constexpr MemberRule kLightMembers[] = {
    {"color"},
    {"intensity"},
    {"type"},
    {"spot", &kSpot},
    {"range", nullptr, "light has no end here: it falls off with the square of the distance alone"}};
constexpr Kind kLight{"a light", kLightMembers};
constexpr MemberRule kLightsMembers[] = {{"lights", &kLight}, {"light"}};
constexpr MemberRule kClearcoatMembers[] = {{"clearcoatFactor"},
                                            {"clearcoatTexture", &kTextureInfo},
                                            {"clearcoatRoughnessFactor"},
                                            {"clearcoatRoughnessTexture", &kTextureInfo},
                                            {"clearcoatNormalTexture", &kTextureInfo}};
constexpr MemberRule kStrengthMembers[] = {{"emissiveStrength"}};
constexpr MemberRule kIorMembers[] = {{"ior"}};
constexpr MemberRule kSpecularMembers[] = {{"specularFactor"},
                                           {"specularTexture", &kTextureInfo},
                                           {"specularColorFactor"},
                                           {"specularColorTexture", &kTextureInfo}};
constexpr MemberRule kTransmissionMembers[] = {{"transmissionFactor"},
                                               {"transmissionTexture", &kTextureInfo}};
constexpr MemberRule kVolumeMembers[] = {
    {"thicknessFactor"}, {"thicknessTexture", &kTextureInfo}, {"attenuationDistance"}, {"attenuationColor"}};
constexpr MemberRule kInstancingMembers[] = {{"attributes"}};
constexpr MemberRule kVisibilityMembers[] = {{"visible"}};
// The extensions that are read and have members.
constexpr Kind kMembersOfRead[] = {{"EXT_mesh_gpu_instancing", kInstancingMembers},
                                   {"KHR_lights_punctual", kLightsMembers},
                                   {"KHR_materials_clearcoat", kClearcoatMembers},
                                   {"KHR_materials_emissive_strength", kStrengthMembers},
                                   {"KHR_materials_ior", kIorMembers},
                                   {"KHR_materials_specular", kSpecularMembers},
                                   {"KHR_materials_transmission", kTransmissionMembers},
                                   {"KHR_materials_volume", kVolumeMembers},
                                   {"KHR_node_visibility", kVisibilityMembers},
                                   kTextureTransform};

class IgnoredParts {
 public:
  explicit IgnoredParts(Translation& t) : t_(t) {}

  void object(const Value& value, const Kind& kind) {
    const auto* members = std::get_if<Value::Members>(&value.is);
    if (!members) return;
    for (const Member& m : *members) {
      if (m.name == "name" || m.name == "extras") continue;
      if (m.name == "extensions") {
        extensions(m.value);
        continue;
      }
      const auto rule = std::find_if(kind.members.begin(), kind.members.end(),
                                     [&](const MemberRule& r) { return r.name == m.name; });
      if (rule == kind.members.end())
        unknown(m, kind);
      else if (!rule->ignored.empty())
        warn(m.value, fmt::format("{} has no effect: {}", m.name, rule->ignored));
      else if (rule->kind)
        each(m.value, *rule->kind);
    }
    if (&kind == &kPrimitive) attributes(value);
  }

 private:
  void warn(const Value& at, std::string text) { t_.warn_once(Item(at, t_.report), std::move(text)); }

  void each(const Value& value, const Kind& kind) {
    const auto* list = std::get_if<Value::List>(&value.is);
    if (!list) return object(value, kind);
    for (const Value& one : *list) object(one, kind);
  }

  void unknown(const Member& m, const Kind& kind) {
    if (!t_.report.takes_warnings()) return;
    std::vector<std::string> names;
    for (const MemberRule& r : kind.members) names.emplace_back(r.name);
    warn(m.value, fmt::format("{} has no member {}, which has no effect{}", kind.title, plain_text(m.name),
                              suggestion(m.name, names)));
  }

  void extensions(const Value& value) {
    const auto* members = std::get_if<Value::Members>(&value.is);
    if (!members) return;
    for (const Member& m : *members) {
      const Row* row = find_extension(m.name);
      // With the texts of check_extensions(), so that an extension is reported once.
      if (!row) warn(m.value, fmt::format("{} is not known here, and has no effect", plain_text(m.name)));
      if (row && row->use == Use::ignored)
        warn(m.value, fmt::format("{} has no effect: {}", m.name, row->meaning));
      const auto* kind = std::find_if(std::begin(kMembersOfRead), std::end(kMembersOfRead),
                                      [&](const Kind& k) { return k.title == m.name; });
      if (kind != std::end(kMembersOfRead)) each(m.value, *kind);
    }
  }

  void attributes(const Value& primitive) {
    const Item all = Item(primitive, t_.report)["attributes"];
    const auto* members = all.given() ? std::get_if<Value::Members>(&all.identity()->is) : nullptr;
    if (!members) return;
    static constexpr std::string_view kKnown[] = {"POSITION",  "NORMAL",  "TANGENT", "COLOR_0",
                                                  "TEXCOORD_", "JOINTS_", "WEIGHTS_"};
    for (const Member& m : *members)
      if (!m.name.starts_with("_") && std::none_of(std::begin(kKnown), std::end(kKnown), [&](auto name) {
            return name.ends_with("_") ? m.name.starts_with(name) : m.name == name;
          }))
        warn(m.value, fmt::format("the attribute {} has no effect", plain_text(m.name)));
  }

  Translation& t_;
};

}  // namespace

void warn_of_ignored(Translation& t) { IgnoredParts(t).object(*t.root.identity(), kRoot); }

}  // namespace ls::scene::gltf
