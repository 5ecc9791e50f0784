#include "worker/render/lights/lights.h"

#include <algorithm>

#include "common/base/overloaded.h"

namespace ls::render {

template <class Kind>
void Lights::add(Kind kind) {
  if (kind.dark(world()))
    ++left_out_;
  else
    lights_.push_back({std::move(kind)});
}
template <class... Kind>
void Lights::add(std::variant<Kind...> kind) {
  std::visit([&](auto& k) { add(std::move(k)); }, kind);
}

void Lights::add_area(const Scene& scene, std::uint32_t shape, const SurfacePrimitives& primitives,
                      Geometry& g) {
  const auto lights = static_cast<std::uint32_t>(lights_.size());
  const auto finish = [&](auto& l) {
    const LightBounds box = l.bounds(world());
    l.reach = std::max(largest(box.low), largest(box.high));
    // If the light's surface is null, other surfaces may coincide with it. Shadow rays must then end in front
    // of all of them.
    if (g.surfaces[shape].null) l.reach = std::max(l.reach, g.surfaces[shape].coincident_reach);
    add(std::move(l));
  };
  auto light = make_area_light(scene.shapes[shape], shape, primitives, world());
  std::visit(finish, light);
  if (lights_.size() > lights) g.surfaces[shape].light = lights;
}

Result<void> Lights::add_map(const Scene& scene, const EnvmapEmitter& emitter, const ImageLoader& images) {
  if (map_) return fail(Errc::invalid_argument, "a scene has one environment map at most");
  if (emitter.file.value >= scene.assets.size() || !images)
    return fail(Errc::invalid_argument, "an environment map names a file that the scene does not have");
  const Asset& asset = scene.assets[emitter.file.value];
  auto image = images(asset);
  if (!image) return tl::unexpected(image.error());
  auto map =
      EnvironmentMap::build(asset.name, std::move(*image), emitter.scale, emitter.to_world, emitter.mapping);
  if (!map) return tl::unexpected(map.error());
  clamped_ += map->clamped();
  if (map->black()) {
    ++left_out_;
    return {};
  }
  map_ = std::make_unique<const EnvironmentMap>(std::move(*map));
  sky_.map = map_.get();
  add(sky_);
  return {};
}

Result<void> Lights::add_emitter(const Scene& scene, const Emitter& emitter, const ImageLoader& images) {
  return std::visit(overloaded{[&](const ConstantEmitter& e) -> Result<void> {
                                 environment_ += color(e.radiance);
                                 return {};
                               },
                               [&](const EnvmapEmitter& e) { return add_map(scene, e, images); },
                               [&](const GoniometricEmitter& e) -> Result<void> {
                                 if (textures_->aspect(e.texture) != 1)
                                   return fail(Errc::invalid_argument,
                                               "the image of a goniometric light is not square: turn one in "
                                               "latitude and longitude into the equal-area form");
                                 add(make_light(e, world()));
                                 return {};
                               },
                               [&](const auto& e) -> Result<void> {
                                 add(make_light(e, world()));
                                 return {};
                               }},
                    emitter);
}

Result<Lights> Lights::build(const Scene& scene, Geometry& geometry, const TextureTable& textures,
                             const ImageLoader& images) {
  Lights l;
  l.geometry_ = &geometry;
  l.textures_ = &textures;
  const SurfacePrimitives primitives(geometry);
  for (std::uint32_t i = 0; i < scene.shapes.size(); ++i) {
    if (scene.shapes[i].emitter) l.add_area(scene, i, primitives, geometry);
  }
  for (const Emitter& e : scene.emitters) {
    if (auto ok = l.add_emitter(scene, e, images); !ok) return tl::unexpected(ok.error());
  }
  l.sort_places_first();
  l.set_probabilities();
  if (scene.integrator.light_tree == 0) l.build_tree();
  return l;
}

double Lights::power(const Light& light) const {
  return with_kind(light.kind, [&](const auto& l) { return double{l.power(world())}; });
}

std::vector<V3> Lights::points() const {
  std::vector<const Light*> found;
  for (const Light& l : lights_)
    if (is_point(l)) found.push_back(&l);
  std::stable_sort(found.begin(), found.end(),
                   [&](const Light* a, const Light* b) { return power(*a) > power(*b); });
  std::vector<V3> list;
  for (const Light* l : found)
    list.push_back(pivot({.light = static_cast<std::uint32_t>(l - lights_.data())}).p);
  return list;
}

bool Lights::any_without_place() const { return !std::all_of(lights_.begin(), lights_.end(), has_place); }

Lights::Directional Lights::strongest_directional() const {
  Directional best;
  for (std::size_t i = 0; i < lights_.size(); ++i) {
    const auto* l = std::get_if<DirectionalLight>(&lights_[i].kind);
    if (l && mean_component(l->irradiance) > mean_component(best.irradiance))
      best = {static_cast<std::uint32_t>(i), l->travel, l->irradiance};
  }
  return best;
}

Pivot Lights::pivot(const LightChoice& choice) const {
  return with_kind(lights_[choice.light].kind, [&](const auto& l) -> Pivot {
    if constexpr (std::decay_t<decltype(l)>::kHasPlace)
      return l.pivot(world(), choice.numbers);
    else
      __builtin_unreachable();
  });
}

std::optional<LightSample> Lights::sample(const LightChoice& c, const V3& x) const {
  return with_kind(lights_[c.light].kind,
                   [&](const auto& l) { return l.sample(world(), c.numbers, x, c.probability); });
}

C3 Lights::emitted(const SurfaceHit& hit, const V3& w) const {
  const std::uint32_t i = geometry_->surfaces[hit.surface].light;
  const float cosine = dot(hit.ng, w);
  if (i == kNone) return {0, 0, 0};
  return with_area(hit, [&](const AreaLight& l) {
    return cosine > 0 || (l.two_sided && cosine < 0) ? l.emitted(world(), hit.uv, &hit.face, std::abs(cosine))
                                                     : C3(0);
  });
}

float Lights::pdf(const SurfaceHit& hit, const V3& x, const V3& direction, const LightPlace& place,
                  bool before_point) const {
  const std::uint32_t light = geometry_->surfaces[hit.surface].light;
  const float p =
      before_point && !by_place(place) ? lights_[light].probability : probability_at(light, place);
  return with_area(hit, [&](const auto& l) { return l.pdf(world(), hit, x, direction, p); });
}

Pivot Lights::pivot(const SurfaceHit& hit) const {
  return with_area(hit, [&](const auto& l) { return l.pivot_of(world(), hit); });
}

bool Lights::is_sky(const LightChoice& choice) const {
  return std::holds_alternative<SkyLight>(lights_[choice.light].kind);
}

void Lights::set_portals(std::unique_ptr<const Portals> portals) {
  portals_ = std::move(portals);
  sky_.portals = portals_.get();
  if (portals_)
    sky_.constant += std::exchange(environment_, C3(0));
  else
    environment_ += std::exchange(sky_.constant, C3(0));
  const auto is_sky = [](const Light& l) { return std::holds_alternative<SkyLight>(l.kind); };
  const auto at = std::find_if(lights_.begin(), lights_.end(), is_sky);
  if (!sky_.sampled()) {
    if (at != lights_.end()) lights_.erase(at);
  } else if (at != lights_.end()) {
    at->kind = sky_;
  } else {
    lights_.push_back({sky_});
  }
  local_ = nullptr;
  set_probabilities();
  if (has_tree()) build_tree();
}

std::uint64_t Lights::map_bytes() const {
  return (map_ ? map_->bytes() : 0) + (portals_ ? portals_->bytes() : 0);
}

Lights::EnvironmentParts Lights::environment_parts(const V3& x, const V3& direction,
                                                   const LightPlace& place) const {
  EnvironmentParts parts{environment_, C3(0), 0};
  if (sky_.sampled()) {
    const EnvironmentMap::Light light = sky_.from(x, direction);
    parts.sampled = light.radiance;
    parts.pdf = light.pdf * probability_at(sky_index_, place);
  } else if (!suns_.empty()) {
    const SunLight& sun = *std::get_if<SunLight>(&lights_[suns_.front()].kind);
    parts.sampled = sun.found(direction, kInfinity, 1);
    parts.pdf = sun.density * probability_at(suns_.front(), place);
  }
  return parts;
}

C3 Lights::suns(const V3& direction, float pdf, const LightPlace& place) const {
  C3 sum(0);
  for (const std::uint32_t i : suns_)
    sum += std::get_if<SunLight>(&lights_[i].kind)->found(direction, pdf, probability_at(i, place));
  return sum;
}

}  // namespace ls::render
