#include "common/scene/analysis/needs.h"

#include <algorithm>

#include "common/scene/schema/describe_fields.h"
#include "common/scene/schema/traits.h"

namespace ls::scene {
namespace {

template <class... Ts>
std::string kind_of(const std::variant<Ts...>& x) {
  return std::visit([]<class T>(const T&) { return std::string(kInfo<T>.name); }, x);
}

class Analyst {
 public:
  Analyst(const Scene& scene, bool sees_media) : s_(scene), sees_media_(sees_media) {}

  Needs run() {
    shapes();
    media();
    lights();
    for (const Bsdf& b : s_.bsdfs) {
      ++n_.materials[kind_of(b)];
      n_.compensated += std::visit(
          []<class T>(const T& m) {
            if constexpr (requires { m.multiple_scattering; }) return m.multiple_scattering;
            return false;
          },
          b);
    }
    for (const Texture& t : s_.textures) ++n_.textures[kind_of(t)];
    n_.instances = static_cast<std::uint32_t>(s_.instances.size());
    n_.lens = s_.sensor.aperture_radius > 0;
    n_.crop = s_.film.has_crop();
    files();
    return std::move(n_);
  }

 private:
  void shapes();
  void media();
  void add(const Medium& medium);
  void lights();
  void files();
  void file(AssetIndex i, const std::string& use) {
    if (i.value >= n_.files.size()) return;  // indices of unused volumes are not checked
    auto& uses = n_.files[i.value].uses;
    const auto at = std::lower_bound(uses.begin(), uses.end(), use);
    if (at == uses.end() || *at != use) uses.insert(at, use);
  }

  const Scene& s_;
  const bool sees_media_;
  Needs n_;
};

void Analyst::shapes() {
  const auto traits = bsdf_traits(s_);
  for (const Shape& s : s_.shapes) {
    ++n_.shapes[kind_of(s.geometry)];
    const bool null = std::holds_alternative<NullBsdf>(s_.bsdfs[s.bsdf.value]);
    n_.boundaries = n_.boundaries || null;
    n_.null_transmission = n_.null_transmission || (!null && traits && (*traits)[s.bsdf.value].passes);
    n_.area_lights += s.emitter.has_value();
  }
}

void Analyst::add(const Medium& medium) {
  const MediumTraits m = traits_of(medium, s_.volumes);
  if (!m.extinguishes && !m.emits && !m.grids) return;
  n_.media = true;
  n_.grids = n_.grids || m.grids;
  n_.chromatic = n_.chromatic || m.chromatic;
  n_.density_files = n_.density_files || m.density_file;
  n_.emission = n_.emission || m.emits;
  const PhaseIndex phase = std::visit([](const auto& kind) { return kind.phase; }, medium);
  n_.anisotropic = n_.anisotropic || !std::holds_alternative<IsotropicPhase>(s_.phases[phase.value]);
}

void Analyst::media() {
  if (!sees_media_) return;
  std::vector<bool> used(s_.media.size(), false);
  const auto use = [&](const std::optional<MediumIndex>& m) {
    if (m) used[m->value] = true;
  };
  use(s_.sensor.medium);
  n_.camera_in_medium = s_.sensor.medium.has_value();
  for (const Shape& s : s_.shapes)
    if (s.is_medium_transition) use(s.interior), use(s.exterior);
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    ++n_.media_kinds[kind_of(s_.media[i])];
    add(s_.media[i]);
  }
}

void Analyst::lights() {
  bool extended = n_.area_lights > 0;
  for (const Emitter& e : s_.emitters) {
    ++n_.lights[kind_of(e)];
    extended = extended || !traits_of(e, s_.textures).delta;
  }
  n_.only_delta_lights = !extended && !s_.emitters.empty();
}

void Analyst::files() {
  for (const Asset& a : s_.assets) n_.files.push_back({a.name, a.digest, a.bytes, {}});
  for (const Shape& s : s_.shapes)
    if (const auto* mesh = std::get_if<MeshShape>(&s.geometry)) file(mesh->file, "mesh");
  for (const Texture& t : s_.textures)
    if (const auto* image = std::get_if<BitmapTexture>(&t)) file(image->file, "texture");
  for (const Emitter& e : s_.emitters)
    if (const auto* map = std::get_if<EnvmapEmitter>(&e)) file(map->file, "environment map");
  for (const Volume& v : s_.volumes)
    if (const auto* grid = std::get_if<GridVolume>(&v))
      file(grid->file, grid->grid_name.empty() ? "grid" : "grid " + grid->grid_name);
}

}  // namespace

std::uint32_t Needs::sampled_lights() const {
  std::uint32_t n = area_lights;
  for (const auto& [kind, count] : lights)
    if (kind != kInfo<ConstantEmitter>.name) n += count;
  return n;
}

Needs needs_of(const Scene& scene, bool sees_media) { return Analyst(scene, sees_media).run(); }

}  // namespace ls::scene
