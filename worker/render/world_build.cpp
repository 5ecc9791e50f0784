#include <fmt/format.h>

#include <cmath>

#include "common/assets/image.h"
#include "common/base/overloaded.h"
#include "worker/render/color.h"
#include "worker/render/grid_load.h"
#include "worker/render/world.h"

namespace ls::render {
namespace {

Rgb times(const Rgb& c, double k) { return {c[0] * k, c[1] * k, c[2] * k}; }
Rgb times(const Rgb& a, const Rgb& b) { return {a[0] * b[0], a[1] * b[1], a[2] * b[2]}; }

// Beyond this, products of an extinction with a density and a length leave float32.
constexpr double kMaxExtinction = 1e30;

// g as float32 holds it: .99999999 is 1 there, where the phase function is no function.
Result<HenyeyGreenstein> phase_of(const Scene& scene, PhaseIndex i) {
  const auto* hg = std::get_if<HgPhase>(&scene.phases.at(i.value));
  if (!hg) return HenyeyGreenstein{0};
  const auto g = static_cast<float>(hg->g);
  if (!(std::abs(g) < 1)) {
    return fail(Errc::invalid_argument,
                fmt::format("a phase function's g = {} is, to the precision of the renderer, not between -1 "
                            "and 1; light scattered so far forward passes as if there were no medium",
                            hg->g));
  }
  return HenyeyGreenstein{g};
}

// sigma: per world unit; largest: of the density.
Result<void> check_extinction(const Rgb& sigma, double largest, double world_scale) {
  for (const double s : sigma) {
    if (s <= kMaxExtinction && s * largest <= kMaxExtinction) continue;
    return fail(Errc::invalid_argument,
                fmt::format("a medium's extinction reaches {} per scene unit: check its sigma_t, scale and "
                            "densities",
                            s * largest * world_scale));
  }
  return {};
}

// Lengths shrink by the world's scale, so coefficients grow by its inverse.
Result<Medium> homogeneous(const Scene& scene, const HomogeneousMedium& m, double scale) {
  Medium out;
  const Rgb sigma_t = times(m.sigma_t, m.scale / scale);
  if (auto ok = check_extinction(sigma_t, 1, scale); !ok) return tl::unexpected(ok.error());
  auto phase = phase_of(scene, m.phase);
  if (!phase) return tl::unexpected(phase.error());
  out.sigma_t = color(sigma_t);
  out.sigma_s = color(times(sigma_t, m.albedo));
  out.phase = *phase;
  return out;
}

Result<Medium> heterogeneous(const Scene& scene, const HeterogeneousMedium& m, const AssetLoader& files,
                             World& w) {
  Medium out;
  out.grid = true;
  auto phase = phase_of(scene, m.phase);
  if (!phase) return tl::unexpected(phase.error());
  out.phase = *phase;
  const double per_unit = m.scale / w.geometry.scale;
  auto density =
      load_volume(scene.volumes.at(m.sigma_t.value), files, w.geometry.center, w.geometry.scale, per_unit);
  if (!density) return tl::unexpected(density.error());
  w.clamped_inputs += density->clamped;
  Rgb sigma{per_unit, per_unit, per_unit};
  if (const auto* c = std::get_if<ConstVolume>(&scene.volumes[m.sigma_t.value])) {
    sigma = times(c->value,
                  per_unit);  // the colour goes into the coefficients, the grid is 1 where the medium is
    auto ones = load_volume(ConstVolume{{1, 1, 1}}, files, w.geometry.center, w.geometry.scale, per_unit);
    if (!ones) return tl::unexpected(ones.error());
    density = std::move(ones);
  } else if (density->channels.size() != 1) {
    return fail(
        Errc::invalid_argument,
        fmt::format("{}: a density grid has one channel, this one has {}; give colour through the albedo",
                    files.name(std::get<GridVolume>(scene.volumes[m.sigma_t.value]).file),
                    density->channels.size()));
  }
  if (auto ok = check_extinction(sigma, density->channels[0].max_value(), w.geometry.scale); !ok)
    return tl::unexpected(ok.error());
  w.grids.push_back(std::move(density->channels[0]));
  out.density = &w.grids.back();
  out.sigma_t = color(sigma);
  if (const auto* a = std::get_if<ConstVolume>(&scene.volumes.at(m.albedo.value))) {
    out.sigma_s = color(times(sigma, a->value));
    return out;
  }
  auto albedo =
      load_volume(scene.volumes[m.albedo.value], files, w.geometry.center, w.geometry.scale, per_unit);
  if (!albedo) return tl::unexpected(albedo.error());
  w.clamped_inputs += albedo->clamped;
  for (Grid& g : albedo->channels) {
    w.clamped_inputs += g.count_above(1);  // look-ups stop at 1: no medium scatters more than it takes
    w.grids.push_back(std::move(g));
  }
  const std::size_t n = albedo->channels.size(), first = w.grids.size() - n;
  for (std::size_t k = 0; k < 3; ++k) out.albedo[k] = &w.grids[first + (n == 1 ? 0 : k)];
  return out;
}

// The media that the camera or some surface names.
std::vector<bool> named_media(const Scene& scene) {
  std::vector<bool> named(scene.media.size(), false);
  if (scene.sensor.medium) named[scene.sensor.medium->value] = true;
  for (const Shape& s : scene.shapes) {
    if (!s.is_medium_transition) continue;
    if (s.interior) named[s.interior->value] = true;
    if (s.exterior) named[s.exterior->value] = true;
  }
  return named;
}

// The others keep their place in the list, but nothing of them is loaded.
Result<void> build_media(const Scene& scene, const AssetLoader& files, World& w) {
  const std::vector<bool> named = named_media(scene);
  for (std::size_t i = 0; i < scene.media.size(); ++i) {
    if (!named[i]) {
      w.media.emplace_back();
      continue;
    }
    Result<Medium> m = std::visit(
        overloaded{[&](const HomogeneousMedium& h) { return homogeneous(scene, h, w.geometry.scale); },
                   [&](const HeterogeneousMedium& h) { return heterogeneous(scene, h, files, w); }},
        scene.media[i]);
    if (!m) return tl::unexpected(m.error());
    w.media.push_back(*m);
  }
  return {};
}

Features needs_of(const World& w) {
  Features f;
  if (!w.use_media) return f;
  const auto use = [&](std::uint32_t i) {
    if (i == kNone) return;
    const Medium& m = w.media[i];
    if (is_black(m.sigma_t)) return;
    f.media = true;
    f.grids = f.grids || m.grid;
    f.chromatic = f.chromatic || m.chromatic();
  };
  use(w.camera_medium);
  for (const SurfaceInfo& s : w.geometry.surfaces) {
    if (!s.transition) continue;
    use(s.interior);
    use(s.exterior);
  }
  return f;
}

// What hits on each surface must carry.
void note_surface_needs(const Scene& scene, World& w) {
  for (std::size_t i = 0; i < w.geometry.surfaces.size(); ++i) {
    SurfaceInfo& s = w.geometry.surfaces[i];
    const auto& emitter = scene.shapes[i].emitter;
    s.wants_uv = w.bsdfs.reads_uv(s.bsdf) || (emitter && !w.textures.is_constant(emitter->radiance));
    s.wants_tangent = w.bsdfs.anisotropic(s.bsdf);
    s.smooth = w.bsdfs.has_smooth(s.bsdf);
    w.veils = w.veils || s.veil;
  }
}

Result<void> check_indices(const Scene& scene) {
  const auto bad = [](std::uint32_t i, std::size_t n) { return i >= n; };
  for (const Shape& s : scene.shapes) {
    if (bad(s.bsdf.value, scene.bsdfs.size()) || (s.interior && bad(s.interior->value, scene.media.size())) ||
        (s.exterior && bad(s.exterior->value, scene.media.size())) ||
        (s.emitter && bad(s.emitter->radiance.value, scene.textures.size()))) {
      return fail(Errc::invalid_argument,
                  "a shape refers to a material, medium or texture that the scene does not have");
    }
  }
  if (scene.sensor.medium && bad(scene.sensor.medium->value, scene.media.size())) {
    return fail(Errc::invalid_argument, "the sensor refers to a medium that the scene does not have");
  }
  return {};
}

}  // namespace

Result<std::shared_ptr<const World>> build_world(const Scene& scene, const RenderSettings& settings,
                                                 const AssetFiles& files, int threads) {
  if (auto ok = check_indices(scene); !ok) return tl::unexpected(ok.error());
  if (settings.size.width < 1 || settings.size.height < 1)
    return fail(Errc::invalid_argument, "the film has no pixels");
  const auto world = std::make_shared<World>();
  World& w = *world;
  const AssetLoader loader{scene, files};
  w.seed = settings.seed;
  w.size = settings.size;
  w.max_depth = settings.max_depth;
  w.rr_depth = settings.rr_depth;
  w.use_media = settings.integrator != "path";
  w.distant_mis = settings.integrator == "volpath_distant_mis";
  w.distance = scene.integrator.distance;
  w.heuristic = scene.integrator.heuristic;
  w.hide_emitters = scene.integrator.hide_emitters;
  auto geometry = Geometry::build(scene, loader);
  if (!geometry) return tl::unexpected(geometry.error());
  w.geometry = std::move(*geometry);
  w.clamped_inputs += w.geometry.dropped_triangles;
  auto textures = TextureTable::build(scene, [&](const Asset& a) -> Result<ImageData> {
    const auto it = files.find(a.digest);
    if (it == files.end()) return fail(Errc::internal, "no file was given for '" + a.name + "'");
    return load_image(it->second, a.name);
  });
  if (!textures) return tl::unexpected(textures.error());
  w.textures = std::move(*textures);
  auto bsdfs = BsdfTable::build(scene, w.textures);
  if (!bsdfs) return tl::unexpected(bsdfs.error());
  w.bsdfs = std::move(*bsdfs);
  w.clamped_inputs += w.textures.clamped_texels() + w.bsdfs.clamped_inputs();
  note_surface_needs(scene, w);
  if (w.use_media) {
    if (auto ok = build_media(scene, loader, w); !ok) return tl::unexpected(ok.error());
    if (scene.sensor.medium) w.camera_medium = scene.sensor.medium->value;
  }
  auto lights = Lights::build(scene, w.geometry, w.textures, [&](const Asset& a) -> Result<ImageData> {
    const auto it = files.find(a.digest);
    if (it == files.end()) return fail(Errc::internal, "no file was given for '" + a.name + "'");
    auto image = load_image(it->second, a.name, kMaxEnvironmentPixels);
    if (!image && image.error().code == Errc::resource_exhausted)
      image.error().message += "; scale the environment map down to 8192 x 4096 pixels or less";
    return image;
  });
  if (!lights) return tl::unexpected(lights.error());
  w.lights = std::move(*lights);
  w.clamped_inputs += w.lights.clamped_inputs();
  auto accel = Accel::build(w.geometry, threads);
  if (!accel) return tl::unexpected(accel.error());
  w.accel = std::move(*accel);
  w.camera = Camera(scene.sensor, settings.size, w.geometry.center, w.geometry.scale);
  w.filter = PixelFilter(scene.film.filter);
  w.need = needs_of(w);
  bool homogeneous_media = false;
  for (const Medium& m : w.media) homogeneous_media = homogeneous_media || (!m.grid && !is_black(m.sigma_t));
  w.equiangular = w.need.media && homogeneous_media && w.lights.any_with_place();
  return std::shared_ptr<const World>(world);
}

}  // namespace ls::render
