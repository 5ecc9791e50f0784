#include "worker/render/geometry/vertex_attributes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ls::render {
namespace {

const MeshAttributeTexture& texture_of(const Scene& scene, const scene::AttributeUse& use) {
  return std::get<MeshAttributeTexture>(scene.textures[use.texture.value]);
}
bool per_face(const std::string& name) { return name.starts_with("face_"); }

std::string list_of(const MeshData& mesh) {
  std::string out;
  for (const std::string& name : mesh.attribute_names) out += (out.empty() ? "it has " : ", ") + name;
  return out.empty() ? "it has none" : out;
}

Result<void> check(const MeshAttribute& a, std::string_view file, const scene::AttributeUse& use,
                   double scale) {
  using As = scene::AttributeUse::As;
  if (use.as == As::number && a.components != 1)
    return fail(Errc::invalid_argument,
                fmt::format("'{}': a bsdf reads the attribute \"{}\" as one number, but it has {}: name an "
                            "attribute of one number instead",
                            file, a.name, a.components));
  if (use.as == As::colour && a.components != 3)
    return fail(
        Errc::invalid_argument,
        fmt::format("'{}': a normal map reads the attribute \"{}\", which has one number instead of three",
                    file, a.name));
  float largest = 0;
  for (const float x : a.values) {
    if (!std::isfinite(x))
      return fail(Errc::invalid_argument,
                  fmt::format("'{}': the attribute \"{}\" holds a number that is not finite", file, a.name));
    largest = std::max(largest, x);
  }
  if (a.bytes && !use.in_light && largest * scale > 1.0001)
    return fail(
        Errc::invalid_argument,
        fmt::format(
            "'{}': the attribute \"{}\" is stored in bytes, which are numbers from 0 to 255 (as in "
            "Mitsuba), but a bsdf needs numbers up to 1: set `scale` of the texture to 0.00392157, or "
            "store floats from 0 to 1",
            file, a.name));
  return {};
}

}  // namespace

std::vector<std::string> attribute_names(const Scene& scene, const std::vector<scene::AttributeUse>& uses) {
  std::vector<std::string> names;
  for (const scene::AttributeUse& use : uses) {
    const std::string& name = texture_of(scene, use).name;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

Result<void> check_attributes(const MeshData& mesh, std::string_view file, const Scene& scene,
                              const std::vector<scene::AttributeUse>& uses) {
  for (const scene::AttributeUse& use : uses) {
    const MeshAttributeTexture& t = texture_of(scene, use);
    const auto it = std::find_if(mesh.attributes.begin(), mesh.attributes.end(),
                                 [&](const MeshAttribute& a) { return a.name == t.name; });
    if (it == mesh.attributes.end())
      return fail(Errc::invalid_argument,
                  fmt::format("the mesh '{}' has no attribute \"{}\", which a texture reads; {}", file,
                              t.name, list_of(mesh)));
    if (auto ok = check(*it, file, use, t.scale); !ok) return ok;
  }
  return {};
}

SurfaceAttributes attributes_of(const Scene& scene) {
  SurfaceAttributes all;
  for (const Texture& t : scene.textures) {
    if (const auto* a = std::get_if<MeshAttributeTexture>(&t))
      all.names.try_emplace(a->name, static_cast<std::uint32_t>(all.names.size()));
  }
  all.first_of.assign(scene.shapes.size(), SurfaceAttributes::kNoChannel);
  return all;
}

void add_channel(SurfaceAttributes& all, const MeshAttribute& a, std::uint32_t surface, std::uint32_t base,
                 const std::vector<std::uint32_t>& kept) {
  const auto name = all.names.find(a.name);
  if (name == all.names.end()) return;
  const bool faces = per_face(a.name);
  const std::size_t count = faces ? kept.size() : a.values.size() / a.components;
  all.channels.push_back({faces, base, static_cast<std::uint32_t>(count), all.values.size(), name->second,
                          all.first_of[surface]});
  all.first_of[surface] = static_cast<std::uint32_t>(all.channels.size() - 1);
  for (std::size_t i = 0; i < count; ++i) {
    const float* v = &a.values[(faces ? kept[i] : i) * a.components];
    C3 c = a.components == 3 ? C3(v[0], v[1], v[2]) : C3(v[0]);
    for (int k = 0; k < 3; ++k) {
      all.clamped += c[k] < 0;
      c[k] = std::max(c[k], 0.f);
    }
    all.values.push_back(c);
  }
}

}  // namespace ls::render
