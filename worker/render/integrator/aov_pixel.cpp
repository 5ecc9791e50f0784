#include "worker/render/integrator/aov_pixel.h"

#include <algorithm>
#include <cmath>

#include "worker/render/integrator/variant.h"
#include "worker/render/math/math.h"

namespace ls::render {
namespace {

constexpr AovSet kOfSurface = AovSet{}
                                  .with(Aov::albedo)
                                  .with(Aov::coverage)
                                  .with(Aov::depth)
                                  .with(Aov::geo_normal)
                                  .with(Aov::normal)
                                  .with(Aov::position)
                                  .with(Aov::uv)
                                  .with(Aov::shape_id)
                                  .with(Aov::material_id);
constexpr AovSet kOfLight = AovSet{}
                                .with(Aov::direct)
                                .with(Aov::emission)
                                .with(Aov::indirect)
                                .with(Aov::multiple)
                                .with(Aov::light_groups)
                                .with(Aov::single)
                                .with(Aov::surface)
                                .with(Aov::volume)
                                .with(Aov::volume_light_groups);
constexpr AovSet kOfGuide = AovSet{}.with(Aov::denoising_albedo).with(Aov::denoising_normal);
constexpr AovSet kOfOpacity =
    AovSet{}.with(Aov::alpha).with(Aov::opacity).with(Aov::volume_opacity).with(Aov::shadow_catcher);
static_assert((kOfSurface.bits() ^ kOfLight.bits() ^ kOfGuide.bits() ^ kOfOpacity.bits()) ==
              (1u << kAovs) - 1);

// Returns the uv of a hit. On spheres it is computed from the position, because SurfaceHit::uv is set there
// only if the surface's material or light needs it.
V2 uv_of(const Geometry& g, const SurfaceHit& hit, float time) {
  if (hit.primitive.kind != PrimitiveId::Kind::sphere) return hit.uv;
  const Sphere& s = g.spheres[hit.primitive.index];
  V3d p(hit.p);
  if (hit.primitive.instance != kNone) p = placed_at(g, hit.primitive.instance, time).to_local.point(p);
  return sphere_uv(s, (p - s.center).normalized());
}

// Estimates the directional albedo of a surface from one sampled direction. The albedo includes neither the
// scaling of radiance by refraction nor the light that passes straight through (null transmission).
C3 albedo_of(const World& w, const FirstSurface& first, const SampleStream& stream, const V3& d) {
  const SurfaceHit& hit = first.hit;
  const Group g = stream.group(0, Purpose::albedo);
  const auto s = w.bsdfs.sample(w.geometry.surfaces[hit.surface].bsdf, hit.uv_point(),
                                hit.shading.to_local(-d), g.u(2), {g.u(0), g.u(1)});
  if (!s) return C3(0);
  const C3 weight = s->weight * (s->transmitted ? s->eta * s->eta : 1.f) * first.not_passed;
  return is_finite(weight) ? weight : C3(0);
}

}  // namespace

AovPixel::AovPixel(const World& world)
    : world_(world),
      planes_(planes_of(world.aovs)),
      wants_surface_(world.aovs.any_of(kOfSurface)),
      wants_light_(world.aovs.any_of(kOfLight)),
      wants_guide_(world.aovs.any_of(kOfGuide)),
      wants_opacity_(world.aovs.any_of(kOfOpacity) || world.aovs.deep().count > 0),
      slices_(world.aovs.deep()) {
  split_.by_depth.wanted = slices_.records() > 0 && world.aovs.deep().colours;
  through_.resize(world.aovs.deep().count);
  for (auto& of_aov : group_sums_)
    for (auto& of_half : of_aov) of_half.resize(world.aovs.groups());
}

void AovPixel::begin_pixel(int x, int y) {
  if (slices_.records() > 0) {
    const int fx = x + world_.origin_x, fy = y + world_.origin_y;
    edges_ = world_.deep_edges.get(fx, fy, [&] { return deep_edges(world_, fx, fy); });
    split_.by_depth.edges = edges_.between;
    slice_light_.assign(slices_.records(), Sums{});
    slice_through_.assign(slices_.records(), 0);
  }
  sums_ = {};
  for (auto& of_aov : group_sums_)
    for (auto& of_half : of_aov) std::ranges::fill(of_half, Sums{});
  hits_ = 0;
  shapes_.clear();
  materials_.clear();
}

void AovPixel::add(Aov aov, const V3d& v, std::size_t half) {
  Sums& s = sums_[half][static_cast<std::size_t>(aov)];
  for (std::size_t c = 0; c < 3; ++c) s[c] += v[static_cast<int>(c)];
}

void AovPixel::end_sample(int x, int y, std::uint64_t sample, bool usable) {
  if (wants_light_ && usable) add_light(sample & 1);
  if (split_.by_depth.wanted && usable) add_slices();
  if (!wants_surface_ && !wants_guide_ && !wants_opacity_) return;
  x += world_.origin_x;
  y += world_.origin_y;
  const SampleStream stream(world_.seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                            sample);
  const CameraRay ray = camera_ray(world_, stream, x, y);
  if (wants_guide_) add_guide(ray, stream, sample & 1);
  if (wants_opacity_) add_opacity(ray, stream, sample & 1);
  if (!wants_surface_) return;
  const auto first = PathTracer<Features{.passing = true, .motion = true}>(world_, stream).first_surface(ray);
  if (first) add_surface(*first, stream, ray);
}

// Adds the light components of a sample whose radiance is usable. A component that is not finite counts as 0.
void AovPixel::add_light(std::size_t half) {
  const auto part = [&](LightPart p) {
    const C3& c = split_.parts[static_cast<std::size_t>(p)];
    return is_finite(c) ? V3d(c) : V3d(0);
  };
  const V3d e = part(LightPart::unscattered), s1 = part(LightPart::surface_once),
            s2 = part(LightPart::surface_again), v1 = part(LightPart::volume_once),
            v2 = part(LightPart::volume_again);
  add(Aov::emission, e);
  add(Aov::direct, e + s1 + v1);
  add(Aov::indirect, s2 + v2);
  add(Aov::surface, s1 + s2);
  add(Aov::volume, v1 + v2);
  add(Aov::single, v1);
  add(Aov::multiple, v2);
  for (std::size_t g = 0; g < split_.groups; ++g)
    for (const bool volume : {false, true}) {
      const C3& light = (volume ? split_.volume_by_group : split_.by_group)[g];
      if (!is_finite(light)) continue;
      Sums& sums = group_sums_[volume][half][g];
      for (std::size_t c = 0; c < 3; ++c) sums[c] += double{light[static_cast<int>(c)]};
    }
}

void AovPixel::add_surface(const FirstSurface& first, const SampleStream& stream, const CameraRay& ray) {
  const SurfaceHit& hit = first.hit;
  const AovSet wanted = world_.aovs;
  hits_ += 1;
  add(Aov::coverage, {1, 0, 0});
  const double distance =
      (V3d(hit.p) - V3d(ray.o)).dot(V3d(ray.d)) + double{world_.camera.near_distance(ray)};
  add(Aov::depth, {distance / world_.geometry.scale, 0, 0});
  add(Aov::position, V3d(hit.p) / world_.geometry.scale + world_.geometry.center);
  add(Aov::normal, V3d(hit.shading.n));
  add(Aov::geo_normal, V3d(hit.ng));
  if (wanted.has(Aov::uv)) {
    const V2 uv = uv_of(world_.geometry, hit, ray.time);
    add(Aov::uv, {uv.x, uv.y, 0});
  }
  if (wanted.has(Aov::albedo)) add(Aov::albedo, V3d(albedo_of(world_, first, stream, ray.d)));
  const std::uint32_t instance = hit.primitive.instance;
  if (wanted.has(Aov::shape_id))
    add_id(shapes_, instance == kNone ? world_.shape_ids[hit.surface] : world_.instance_ids[instance]);
  if (wanted.has(Aov::material_id)) add_id(materials_, world_.material_ids[hit.surface]);
}

void AovPixel::add_guide(const CameraRay& ray, const SampleStream& stream, std::size_t half) {
  const DenoisingGuide guide = PathTracer<kAnyMotion>(world_, stream).denoising_guide(ray);
  if (is_finite(guide.albedo)) add(Aov::denoising_albedo, V3d(guide.albedo), half);
  const V3d& n = guide.normal;
  if (std::isfinite(n.x + n.y + n.z)) add(Aov::denoising_normal, n, half);
}

void AovPixel::add_opacity(const CameraRay& ray, const SampleStream& stream, std::size_t half) {
  constexpr Features kFeatures = kAnyMotion.with(&Features::visibility);
  const bool deep = slices_.records() > 0;
  const DeepTransmittance slices{edges_.between, edges_.surfaces, through_};
  if (deep) std::ranges::fill(through_, 0.0);
  const Opacity opacity = PathTracer<kFeatures>(world_, stream).opacity(ray, deep ? &slices : nullptr);
  const bool finite = is_finite(opacity.all) && is_finite(opacity.media);
  const V3d all(finite ? opacity.all : C3(0));
  if (deep) {
    for (std::size_t i = 0; i < through_.size(); ++i)
      slice_through_[i] += finite && std::isfinite(through_[i]) ? through_[i] : 1;
    slice_through_.back() += 1 - (all.x + all.y + all.z) / 3;
  }
  if (!finite) return;
  add(Aov::alpha, {(all.x + all.y + all.z) / 3, 0, 0}, half);
  add(Aov::opacity, all, half);
  add(Aov::volume_opacity, V3d(opacity.media), half);
  if (is_finite(opacity.shadow)) add(Aov::shadow_catcher, V3d(opacity.shadow), half);
}

// Adds the light of a usable sample to the slices. Light that is not finite counts as 0.
void AovPixel::add_slices() {
  for (const LightByDepth::Event& event : split_.by_depth.events) {
    if (!is_finite(event.light)) continue;
    const float depth = event.surface ? depth_in(edges_.surfaces, event.depth) : event.depth;
    const auto at = std::ranges::upper_bound(edges_.between, depth);
    const std::size_t slice = std::isinf(event.depth) ? slices_.records() - 1
                                                      : static_cast<std::size_t>(at - edges_.between.begin());
    for (std::size_t c = 0; c < 3; ++c) slice_light_[slice][c] += double{event.light[static_cast<int>(c)]};
  }
}

void AovPixel::add_id(std::vector<IdSlot>& seen, float id) {
  const auto known = std::find_if(seen.begin(), seen.end(), [&](const IdSlot& s) { return s.id == id; });
  if (known != seen.end())
    known->n += 1;
  else
    seen.push_back({id, 1});
}

void AovPixel::store(float* planes, std::size_t pixels, std::size_t i) const {
  for (std::size_t p = 0; p < planes_.sums.size(); ++p) {
    const AovPlane& plane = planes_.sums[p];
    const auto half = static_cast<std::size_t>(plane.half), aov = static_cast<std::size_t>(plane.aov);
    const bool by_group = row_of(plane.aov).kind == AovKind::groups;
    const Sums& of_aov =
        by_group ? group_sums_[plane.aov == Aov::volume_light_groups][half][plane.group] : sums_[half][aov];
    planes[p * pixels + i] = rounded(plane.hits ? hits_ : of_aov[static_cast<std::size_t>(plane.component)]);
  }
  float* deep = planes + planes_.sums.size() * pixels + i;
  for (std::size_t k = 0; k < slices_.records(); ++k) {
    deep[slices_.edge(k) * pixels] = rounded(edges_.stated[k] / world_.geometry.scale);
    deep[slices_.transmittance(k) * pixels] = rounded(slice_through_[k]);
    if (!world_.aovs.deep().colours) continue;
    for (std::size_t c = 0; c < 3; ++c) deep[slices_.light(k, c) * pixels] = rounded(slice_light_[k][c]);
  }
  float* ids = planes + planes_.all_sums() * pixels + i;
  for (const Aov aov : planes_.ids) {
    store_slots(ranked(aov == Aov::shape_id ? shapes_ : materials_), ids, pixels);
    ids += kIdPlanes * pixels;
  }
}

}  // namespace ls::render
