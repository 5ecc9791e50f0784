#include "core/scene/analysis/needs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/scene/schema/describe_fields.h"
#include "core/scene/schema/light_links.h"
#include "core/scene/schema/traits.h"
#include "core/scene/schema/validate.h"

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
    n_.camera_motion = !s_.sensor.motion.empty();
    const auto moving = [](const auto& one) { return !one.motion.empty(); };
    n_.moving_shapes = static_cast<std::uint32_t>(std::ranges::count_if(s_.shapes, moving) +
                                                  std::ranges::count_if(s_.instances, moving));
    n_.crop = s_.film.has_crop();
    n_.transparent_film = s_.film.transparent;
    n_.meters = static_cast<std::uint32_t>(meter_count(s_));
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
    if (i.value >= n_.files.size()) return;  // not a valid index; consistent scenes have none
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
    n_.flagged_shapes += !s.visible_camera || s.holdout || catches_shadows(s_, s);
    n_.ray_flags += !s.visible_shadow || !s.visible_reflection || !s.visible_volume;
  }
}

void Analyst::add(const Medium& medium) {
  const MediumTraits m = traits_of(medium, s_.volumes);
  if (!m.extinguishes && !m.emits && !m.grids) return;
  n_.media = true;
  n_.grids = n_.grids || m.grids;
  n_.height = n_.height || m.height;
  n_.chromatic = n_.chromatic || m.chromatic;
  n_.density_files = n_.density_files || m.density_file;
  n_.emission = n_.emission || m.emits;
  const PhaseIndex phase = std::visit([](const auto& kind) { return kind.phase; }, medium);
  const Phase& kind = s_.phases[phase.value];
  const bool isotropic = std::holds_alternative<IsotropicPhase>(kind);
  n_.anisotropic = n_.anisotropic || !isotropic;
  n_.phases = n_.phases || !(isotropic || std::holds_alternative<HgPhase>(kind));
}

void Analyst::media() {
  if (!sees_media_) return;
  std::vector<bool> used(s_.media.size(), false);
  const auto use = [&](const std::optional<MediumIndex>& m) {
    if (m) used[m->value] = true;
  };
  use(s_.sensor.medium);
  for (const Meter& m : s_.meters) use(m.medium);
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
    n_.ray_flags += std::visit([](const auto& l) { return !l.visible_reflection || !l.visible_volume; }, e);
    const bool delta = traits_of(e, s_.textures).delta;
    extended = extended || !delta;
    n_.delta_lights += delta && std::visit([](const auto& l) { return l.visible_reflection; }, e);
  }
  n_.only_delta_lights = !extended && !s_.emitters.empty();
  n_.linked_lights = ls::scene::linked_lights(s_);
}

void Analyst::files() {
  for (const Volume& v : s_.volumes)
    if (!std::holds_alternative<ConstVolume>(v) && !std::holds_alternative<GridVolume>(v) &&
        !std::holds_alternative<HeightFogVolume>(v))
      ++n_.volumes[kind_of(v)];
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

namespace {

using nlohmann::json;

std::uint32_t count(const std::map<std::string, std::uint32_t>& of, std::string_view kind) {
  const auto it = of.find(std::string(kind));
  return it == of.end() ? 0 : it->second;
}
template <class... T>
std::uint32_t count(const std::map<std::string, std::uint32_t>& of) {
  return (count(of, kInfo<T>.name) + ...);
}
// Returns, for example, "2 sphere, 1 mesh".
std::string listed(const std::map<std::string, std::uint32_t>& kinds) {
  std::vector<std::string> parts;
  for (const auto& [kind, n] : kinds) parts.push_back(fmt::format("{} {}", n, kind));
  return fmt::format("{}", fmt::join(parts, ", "));
}

// Formats a JSON value that another process has sent, for a message: on one line, truncated to 80 characters.
std::string shown(const json& j) {
  std::string text = j.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > 80) text = text.substr(0, 77) + "...";
  return text;
}

class Words {
 public:
  explicit Words(const Needs& n) : n_(n) {}

  std::vector<Need> run() {
    surfaces();
    media();
    textures();
    lights();
    if (n_.meters > 0) {
      say("meters", true,
          fmt::format(
              "{} values to measure; paths share nothing, so path_reuse and light_vertices are left out",
              n_.meters),
          "");
      return std::move(out_);
    }
    say("thin lens", n_.lens, "the aperture has a radius", "the camera is a pinhole");
    say("camera motion", n_.camera_motion, "the camera moves while the shutter is open",
        "the camera stands still");
    say("crop of the frame", n_.crop, "part of the frame", "the whole frame");
    say("transparent film", n_.transparent_film, "the camera does not see the environment",
        "the environment is in the picture");
    return std::move(out_);
  }

 private:
  void say(std::string part, bool used, std::string why, std::string why_not) {
    out_.push_back({std::move(part), used, used ? std::move(why) : std::move(why_not)});
  }
  void say(std::string part, std::uint32_t n, std::string_view what) {
    say(std::move(part), n > 0, fmt::format("{} {}", n, what), fmt::format("no {}", what));
  }
  void surfaces() {
    say("surfaces", !n_.shapes.empty(), listed(n_.shapes), "no shape");
    say("meshes", count<MeshShape>(n_.shapes), "mesh files");
    say("user geometries in the BVH", count<SphereShape, DiskShape, CylinderShape>(n_.shapes),
        "spheres, disks, cylinders");
    say("instances of groups", n_.instances, "instances");
    say("motion of shapes", n_.moving_shapes > 0,
        fmt::format("shapes or instances that move while the shutter is open: {}; path_reuse, "
                    "light_vertices, sky_portals and local_lights, which bring together paths of different "
                    "times, are left out",
                    n_.moving_shapes),
        "all shapes stand still");
    say("dielectrics", count<DielectricBsdf, RoughDielectricBsdf>(n_.materials), "materials");
    say("rough surfaces",
        count<RoughConductorBsdf, RoughPlasticBsdf, RoughDielectricBsdf, CoatedConductorBsdf>(n_.materials),
        "materials");
    say("principled materials", count<PrincipledBsdf>(n_.materials), "materials");
    say("multiple scattering between microfacets", n_.compensated, "materials");
    say("blends", count<BlendBsdf>(n_.materials), "materials");
    say("surfaces that let light pass straight on", n_.null_transmission,
        "masks or thin sheets: shadow rays collect", "no masks or thin sheets");
    say("visibility by the camera", n_.flagged_shapes,
        "shapes hidden from the camera, held out or that catch shadows");
    say("visibility by other rays", n_.ray_flags, "shapes and lamps hidden from shadow or scattered rays");
    say("light linking", n_.linked_lights > 0,
        fmt::format("{} lights have receivers or blockers; path_reuse, light_vertices, sky_portals, "
                    "local_lights and sky_samples, which do not know of it, are left out",
                    n_.linked_lights),
        "all receive the light of all lights");
    say("normal maps", count<NormalMapBsdf, BumpMapBsdf>(n_.materials), "normal and bump maps");
  }
  void media() {
    const std::string none = n_.media_kinds.empty() ? "no medium" : "no such medium";
    say("participating media", n_.media, listed(n_.media_kinds), "no medium");
    for (const std::string_view kind : kKindsOf<Medium>) {
      const std::string media = fmt::format("{} media", kind);
      say(media, count(n_.media_kinds, kind), media);
    }
    std::vector<std::string> grids;
    for (const FileNeed& f : n_.files)
      for (const std::string& use : f.uses)
        if (use.starts_with("grid")) grids.push_back(fmt::format("{} of {}", use, f.name));
    say("fog that falls with height", n_.height,
        "its flights and transmittances are formulas; path_reuse, which does not know it, is left out", none);
    say("volumes without a file", !n_.volumes.empty(),
        listed(n_.volumes) + ", computed at each point that is looked up",
        "no noise, cloud, product or remap");
    say("volume grids", !grids.empty(), fmt::format("{}", fmt::join(grids, ", ")), "no grid file");
    say("chromatic extinction", n_.chromatic, "extinction differs between channels",
        n_.density_files ? "extinction is grey, but for density files of three channels"
        : n_.media       ? "extinction is grey"
                         : none);
    say("light given off by media", n_.emission, "some medium glows", n_.media ? "no medium glows" : none);
    say("anisotropic phase functions", n_.anisotropic, "scattering has a direction",
        n_.media ? "all scattering is isotropic" : none);
    say("other phase functions", n_.phases, "scattering that is not Henyey-Greenstein's",
        n_.media ? "all scattering is isotropic or Henyey-Greenstein's" : none);
    if (n_.meters == 0)
      say("camera inside a medium", n_.camera_in_medium, "the sensor names a medium", "it stands in vacuum");
    say("index-matched boundaries", n_.boundaries, "surfaces that light passes unchanged", "no such surface");
  }
  void textures() {
    say("bitmap textures", count<BitmapTexture>(n_.textures), "bitmaps");
    say("mesh attributes", count<MeshAttributeTexture>(n_.textures), "textures that meshes carry");
  }
  void lights() {
    const std::uint32_t sampled = n_.sampled_lights();
    say("next-event estimation", sampled > 0, fmt::format("{} lights to sample", sampled),
        n_.emission
            ? "no lamp to sample; volpath looks for grids that give off light if that pays (emissive_grids)"
            : "no light to sample: paths find what shines");
    say("choice among lights", sampled > 1, fmt::format("{} lights", sampled), "one light at most");
    say("area lights", n_.area_lights, "shining shapes");
    say("point and spot lights",
        sampled - n_.area_lights - count<DirectionalEmitter, EnvmapEmitter>(n_.lights),
        "points, spots, projectors");
    say("directional lights", count<DirectionalEmitter>(n_.lights), "directions");
    const std::uint32_t constant = count<ConstantEmitter>(n_.lights), map = count<EnvmapEmitter>(n_.lights);
    say("environment light", constant + map > 0, map > 0 ? "an environment map" : "a constant surrounding",
        "black surroundings");
    say("environment map", map, "environment maps");
    missing_light();
  }
  // Light that no path finds. It is said only of scenes that have it.
  void missing_light() {
    const std::uint32_t smooth = count<ConductorBsdf, DielectricBsdf, PlasticBsdf>(n_.materials);
    if (n_.delta_lights == 0 || smooth == 0) return;
    out_.push_back(
        {"light of lamps without extent by way of smooth surfaces", false,
         fmt::format(
             "missing in the image. Lights without extent: {}; smooth mirrors, glasses and glossy coats: {}. "
             "No path can follow light from such a surface to a point or a single direction. Give the "
             "light an extent (angular_radius of a directional one; instead of a point or spot a small "
             "sphere with an area emitter), the surface a roughness, or make panes of glass and sheets of "
             "water thindielectric",
             n_.delta_lights, smooth)});
  }

  const Needs& n_;
  std::vector<Need> out_;
};

}  // namespace

std::string canonical_json(const Needs& n) {
  json j{{"media", n.media},
         {"grids", n.grids},
         {"chromatic", n.chromatic},
         {"emission", n.emission},
         {"anisotropic", n.anisotropic},
         {"camera_in_medium", n.camera_in_medium},
         {"boundaries", n.boundaries},
         {"veils", n.null_transmission},
         {"lens", n.lens},
         {"crop", n.crop},
         {"shapes", n.shapes},
         {"materials", n.materials},
         {"textures", n.textures},
         {"lights", n.lights},
         {"media_kinds", n.media_kinds},
         {"area_lights", n.area_lights},
         {"compensated", n.compensated},
         {"density_files", n.density_files},
         {"instances", n.instances},
         {"only_delta_lights", n.only_delta_lights}};
  // Left out of scenes without them, so that the needs of stored jobs stay the same.
  if (n.transparent_film) j["transparent_film"] = true;
  if (n.phases) j["phases"] = true;
  if (n.camera_motion) j["camera_motion"] = true;
  if (n.moving_shapes > 0) j["moving_shapes"] = n.moving_shapes;
  if (n.height) j["height"] = true;
  if (!n.volumes.empty()) j["volumes"] = n.volumes;
  if (n.meters > 0) j["meters"] = n.meters;
  if (n.flagged_shapes > 0) j["flagged_shapes"] = n.flagged_shapes;
  if (n.ray_flags > 0) j["ray_flags"] = n.ray_flags;
  if (n.linked_lights > 0) j["linked_lights"] = n.linked_lights;
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string first_difference(const std::string& here, const std::string& there) {
  if (here == there) return "";
  const json a = json::parse(here, nullptr, false), b = json::parse(there, nullptr, false);
  if (!a.is_object() || !b.is_object()) return "one of them is no list of needs";
  const json none;
  for (const auto* keys : {&a, &b})
    for (const auto& [key, unused] : keys->items()) {
      const json &x = a.contains(key) ? a.at(key) : none, &y = b.contains(key) ? b.at(key) : none;
      if (x != y) return fmt::format("{}: {} here, {} there", key, shown(x), shown(y));
    }
  return "they are written differently";
}

std::vector<Need> in_words(const Needs& needs) { return Words(needs).run(); }

}  // namespace ls::scene
