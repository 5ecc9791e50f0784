#include "worker/render/world/world_build.h"

#include <fmt/format.h>

#include <cmath>

#include "core/base/overloaded.h"
#include "core/scene/schema/traits.h"
#include "worker/render/math/blackbody.h"
#include "worker/render/math/transform.h"
#include "worker/render/media/field_build.h"
#include "worker/render/media/grid_load.h"
#include "worker/render/world/phase_build.h"

namespace ls::render {
namespace {

Rgb times(const Rgb& c, double k) { return {c[0] * k, c[1] * k, c[2] * k}; }
Rgb times(const Rgb& a, const Rgb& b) { return {a[0] * b[0], a[1] * b[1], a[2] * b[2]}; }

// The largest extinction [1/world unit]. The products of larger values with a density and a length would
// leave the range of float32.
constexpr double kMaxExtinction = 1e30;
// The largest emission of a medium [radiance per world unit, or radiance if it is multiplied by the
// absorption coefficient]. The integral of a larger value along a ray could exceed the largest radiance of a
// sample.
constexpr double kMaxEmission = 1e25;

// Checks that the extinction of a medium is at most kMaxExtinction: both `sigma`, the extinction per unit of
// density [1/world unit], and its product with `largest`, the medium's largest density.
Result<void> check_extinction(const Rgb& sigma, double largest, double world_scale) {
  for (const double s : sigma) {
    if (s <= kMaxExtinction && s * largest <= kMaxExtinction) continue;
    return fail(
        Errc::invalid_argument,
        fmt::format("a medium's extinction reaches {} per scene unit, more than the limit of {}: reduce "
                    "its sigma_t, scale or densities",
                    s * std::max(largest, 1.) * world_scale, kMaxExtinction * world_scale));
  }
  return {};
}

// Sets the emission of m to `factor` and its kind to `emission_kind`, or to none if m emits nothing. During
// rendering the emission is multiplied by the value of a grid or the radiance of a black body; `largest` is
// the largest value of this second factor, or 1 if there is none. Fails with invalid_argument if the product
// of the two exceeds kMaxEmission.
Result<void> shine(Medium& m, EmissionKind emission_kind, const Rgb& factor, double largest) {
  for (const double e : factor)
    if (!(e * largest <= kMaxEmission))
      return fail(
          Errc::invalid_argument,
          fmt::format("a medium's emission reaches {}: check its emission and emission_scale", e * largest));
  m.emission = color(factor);
  m.emission_kind = is_black(m.emission) || !(largest > 0) ? EmissionKind::none : emission_kind;
  return {};
}

// Makes a homogeneous medium. Lengths are multiplied by the world's scale, so coefficients are divided by it.
Result<Medium> homogeneous(const Scene& scene, const HomogeneousMedium& m, const World& w) {
  const double scale = w.geometry.scale;
  Medium out;
  const Rgb sigma_t = times(m.sigma_t, m.scale / scale);
  if (auto ok = check_extinction(sigma_t, 1, scale); !ok) return tl::unexpected(ok.error());
  set_phase(scene, m.phase, w.phases, out);
  out.sigma_t = color(sigma_t);
  out.sigma_s = color(times(sigma_t, m.albedo));
  Rgb emission{};
  for (std::size_t c = 0; c < 3; ++c)
    emission[c] = m.emission[c] / scale + sigma_t[c] * (1 - m.albedo[c]) * m.source_radiance[c];
  if (auto ok = shine(out, EmissionKind::per_length, emission, 1); !ok) return tl::unexpected(ok.error());
  return out;
}

// The extinction per unit of value (density_to_sigma of Grid) that is assumed for emission grids when they
// are loaded. It is this large only to make their macro cells small, so that walks along rays can skip the
// cells without emission.
constexpr double kFine = 1e30;
// An upper bound of the linear sRGB components of a black body whose spectrum is scaled to the peak 1: its
// XYZ are at most 1 each, and the positive elements of a row of the matrix from XYZ to linear sRGB add up to
// less than this.
constexpr double kBrightestOfPeakOne = 3.25;

struct HeteroBuilder {
  const Scene& scene;
  const HeterogeneousMedium& m;
  const AssetLoader& files;
  World& w;
  double per_unit;  // extinction per unit of density, before multiplication by the tint [1/world unit]
  Medium out;
  Rgb sigma{};  // out.sigma_t before rounding to float32

  Result<LoadedVolume> load(const Volume& volume, double to_sigma) const {
    return load_volume(volume, files, w.geometry.center, w.geometry.scale, to_sigma);
  }
  std::array<const Grid*, 3> keep(LoadedVolume& volume) {
    w.inputs.add(HealthCause::negative_density, volume.clamped);
    for (Grid& g : volume.channels) w.grids.push_back(std::move(g));
    if (volume.field) w.fields.push_back(std::move(volume.field));
    const std::size_t n = volume.channels.size(), first = w.grids.size() - n;
    return {&w.grids[first], &w.grids[first + (n == 1 ? 0 : 1)], &w.grids[first + (n == 1 ? 0 : 2)]};
  }
  Result<void> density();
  Result<void> albedo();
  Result<void> set_emission();
  Result<void> medium_emission_of(EmissionKind kind, const Volume& source);
  Result<void> black_bodies(const Volume& temperature);
  Result<LoadedVolume> one_channel(const Volume& volume, std::string_view what) const;
};

Result<void> HeteroBuilder::density() {
  const Volume& volume = scene.volumes.at(m.sigma_t.value);
  sigma = times(m.tint, per_unit);
  Volume shape = volume;
  if (auto* c = std::get_if<ConstVolume>(&shape)) {
    // A constant density, which may be a colour, is multiplied into the coefficients; the grid is then 1
    // inside the medium.
    sigma = times(c->value, sigma);
    c->value = {1, 1, 1};
  }
  auto loaded = load(shape, per_unit * std::max({m.tint[0], m.tint[1], m.tint[2]}));
  if (!loaded) return tl::unexpected(loaded.error());
  std::vector<Grid>& grids = loaded->channels;
  if (grids.size() == 3 && grids[0].same_values(grids[1]) && grids[0].same_values(grids[2])) grids.resize(1);
  float largest = 0;
  int cells = grids[0].cell_size();
  for (const Grid& g : grids) {
    largest = std::max(largest, g.max_value());
    cells = std::min(cells, g.cell_size());
  }
  if (auto ok = check_extinction(sigma, largest, w.geometry.scale); !ok) return tl::unexpected(ok.error());
  if (grids.size() == 3) {
    if (sigma[0] != sigma[1] || sigma[1] != sigma[2])
      return fail(Errc::invalid_argument,
                  fmt::format("{}: a density of three channels has colours of its own: leave out 'tint'",
                              files.name(std::get<GridVolume>(volume).file)));
    for (Grid& g : grids)
      if (g.cell_size() != cells) g.use_cells(cells);
    Grid mean = Grid::mean(grids[0], grids[1], grids[2]);
    out.by_channel = keep(*loaded);
    out.density = &w.grids.emplace_back(std::move(mean));
  } else {
    out.density = keep(*loaded)[0];
  }
  out.sigma_t = color(sigma);
  return {};
}

Result<void> HeteroBuilder::albedo() {
  const Volume& volume = scene.volumes.at(m.albedo.value);
  if (const auto* a = std::get_if<ConstVolume>(&volume)) {
    out.sigma_s = color(times(sigma, a->value));
    out.absorbing = color({1 - a->value[0], 1 - a->value[1], 1 - a->value[2]});
    return {};
  }
  auto loaded = load(volume, per_unit);
  if (!loaded) return tl::unexpected(loaded.error());
  // Albedos above 1 are clamped whenever the grid is read (Medium::scattering_at), because no medium scatters
  // more light than it extinguishes. They are only counted here.
  for (const Grid& g : loaded->channels) w.inputs.add(HealthCause::bright_albedo, g.count_above(1));
  out.albedo = keep(*loaded);
  return {};
}

Result<void> HeteroBuilder::set_emission() {
  if (m.emission) return medium_emission_of(EmissionKind::per_length, scene.volumes.at(m.emission->value));
  if (m.source_radiance)
    return medium_emission_of(EmissionKind::per_absorption, scene.volumes.at(m.source_radiance->value));
  if (m.temperature) return black_bodies(scene.volumes.at(m.temperature->value));
  return {};
}

Result<void> HeteroBuilder::medium_emission_of(EmissionKind kind, const Volume& source) {
  const double k = m.emission_scale / (kind == EmissionKind::per_length ? w.geometry.scale : 1);
  if (const auto* c = std::get_if<ConstVolume>(&source)) return shine(out, kind, times(c->value, k), 1);
  auto loaded = load(source, kFine);
  if (!loaded) return tl::unexpected(loaded.error());
  double largest = 0;
  for (const Grid& g : loaded->channels) largest = std::max<double>(largest, g.max_value());
  out.emitter = keep(*loaded);
  return shine(out, kind, {k, k, k}, largest);
}

Result<LoadedVolume> HeteroBuilder::one_channel(const Volume& volume, std::string_view what) const {
  auto loaded = load(volume, kFine);
  if (loaded && loaded->channels.size() != 1)
    return fail(Errc::invalid_argument,
                fmt::format("{}: {} grid has one channel, this one has {}",
                            files.name(std::get<GridVolume>(volume).file), what, loaded->channels.size()));
  return loaded;
}

Result<void> HeteroBuilder::black_bodies(const Volume& temperature) {
  Rgb k{m.emission_scale, m.emission_scale, m.emission_scale};
  const Grid* weight = nullptr;
  if (m.emission_weight) {
    const Volume& volume = scene.volumes.at(m.emission_weight->value);
    if (const auto* c = std::get_if<ConstVolume>(&volume)) {
      k = times(k, c->value);
    } else {
      auto loaded = one_channel(volume, "an emission_weight");
      if (!loaded) return tl::unexpected(loaded.error());
      weight = keep(*loaded)[0];
    }
  }
  const double heaviest = weight ? weight->max_value() : 1;
  const auto light = [&](double value) {
    const auto kelvin = static_cast<float>(m.temperature_offset + m.temperature_scale * value);
    return m.peak_one ? black_body_of_peak_one(kelvin) : black_body_radiance(kelvin);
  };
  const auto too_hot = [&](double value) {
    // The largest temperature [K]. The radiance of a hotter body would leave the range of float32.
    constexpr double kHottest = 1e30;
    return !(m.temperature_offset + m.temperature_scale * value <= kHottest);
  };
  const auto refused = [] {
    return fail(Errc::invalid_argument, "a medium has a temperature above 1e30 K: lower temperature_scale");
  };
  if (const auto* c = std::get_if<ConstVolume>(&temperature)) {
    if (m.peak_one && too_hot(c->value[0])) return refused();
    const C3 b = light(c->value[0]);
    if (weight) out.emitter = {weight, weight, weight};
    return shine(out, EmissionKind::per_absorption, {k[0] * b.x, k[1] * b.y, k[2] * b.z}, heaviest);
  }
  auto loaded = one_channel(temperature, "a temperature");
  if (!loaded) return tl::unexpected(loaded.error());
  out.emitter = keep(*loaded);
  if (m.peak_one && too_hot(out.emitter[0]->max_value())) return refused();
  out.kelvin_scale = static_cast<float>(m.temperature_scale);
  out.kelvin_offset = static_cast<float>(m.temperature_offset);
  out.peak_one = m.peak_one;
  out.weight = weight;
  // If spectra are scaled to the peak 1, the hottest body need not be the brightest, so the bound for all
  // temperatures is used.
  const C3 hottest = light(out.emitter[0]->max_value());
  const double largest = is_black(hottest) ? 0 : m.peak_one ? kBrightestOfPeakOne : max_component(hottest);
  return shine(out, EmissionKind::black_body, k, largest * heaviest);
}

// Makes a medium whose density falls with height and whose other volumes are constant.
Result<Medium> height_fog(const Scene& scene, const HeterogeneousMedium& m, const HeightFogVolume& fog,
                          const AssetLoader& files, World& w) {
  const double value = fog.value / w.geometry.scale;
  HeteroBuilder b{scene, m, files, w, m.scale * value, {}, {}};
  b.sigma = times(m.tint, b.per_unit);
  if (auto ok = check_extinction(b.sigma, 1, w.geometry.scale); !ok) return tl::unexpected(ok.error());
  auto profile = height_profile(fog, w.geometry.center, w.geometry.scale);
  if (!profile) return tl::unexpected(profile.error());
  b.out.height = *profile;
  b.out.sigma_t = color(b.sigma);
  set_phase(scene, m.phase, w.phases, b.out);
  if (auto ok = b.albedo(); !ok) return tl::unexpected(ok.error());
  if (scene::traits_of(m, scene.volumes).emits)
    if (auto ok = b.set_emission(); !ok) return tl::unexpected(ok.error());
  if (b.out.emission_kind != EmissionKind::none) {
    // From light per absorption to radiance per length at the ground
    Rgb emission{};
    for (std::size_t c = 0; c < 3; ++c) {
      const auto i = static_cast<int>(c);
      emission[c] = b.sigma[c] * b.out.absorbing[i] * b.out.emission[i];
    }
    if (auto ok = shine(b.out, EmissionKind::per_length, emission, 1); !ok) return tl::unexpected(ok.error());
  }
  return b.out;
}

Result<Medium> heterogeneous(const Scene& scene, const HeterogeneousMedium& m, const AssetLoader& files,
                             World& w) {
  if (const auto* fog = std::get_if<HeightFogVolume>(&scene.volumes.at(m.sigma_t.value)))
    return height_fog(scene, m, *fog, files, w);
  HeteroBuilder b{scene, m, files, w, m.scale / w.geometry.scale, {}, {}};
  b.out.grid = true;
  set_phase(scene, m.phase, w.phases, b.out);
  if (auto ok = b.density(); !ok) return tl::unexpected(ok.error());
  if (auto ok = b.albedo(); !ok) return tl::unexpected(ok.error());
  if (scene::traits_of(m, scene.volumes).emits)
    if (auto ok = b.set_emission(); !ok) return tl::unexpected(ok.error());
  return b.out;
}

// Returns, by index of the medium, whether the camera or some surface refers to it.
std::vector<bool> named_media(const Scene& scene) {
  std::vector<bool> named(scene.media.size(), false);
  if (scene.sensor.medium) named[scene.sensor.medium->value] = true;
  for (const Meter& m : scene.meters)
    if (m.medium) named[m.medium->value] = true;
  for (const Shape& s : scene.shapes) {
    if (!s.is_medium_transition) continue;
    if (s.interior) named[s.interior->value] = true;
    if (s.exterior) named[s.exterior->value] = true;
  }
  return named;
}

}  // namespace

Result<void> build_media(const Scene& scene, const AssetLoader& files, World& w) {
  if (auto ok = build_phases(scene, files, w); !ok) return ok;
  const std::vector<bool> named = named_media(scene);
  for (std::size_t i = 0; i < scene.media.size(); ++i) {
    if (!named[i]) {
      w.media.emplace_back();
      continue;
    }
    Result<Medium> m = std::visit(
        overloaded{[&](const HomogeneousMedium& h) { return homogeneous(scene, h, w); },
                   [&](const HeterogeneousMedium& h) { return heterogeneous(scene, h, files, w); }},
        scene.media[i]);
    if (!m) return tl::unexpected(m.error());
    m->priority = std::visit([](const auto& given) { return given.priority; }, scene.media[i]);
    w.media.push_back(*m);
  }
  return {};
}

}  // namespace ls::render
