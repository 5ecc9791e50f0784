#include "worker/render/lights/lights.h"

#include <algorithm>
#include <cmath>

#include "core/base/overloaded.h"
#include "worker/render/geometry/moment.h"

namespace ls::render {
namespace {

// The smallest number of lights with a position for which the light tree (light_tree.h) is used
// (docs/decisions/0008-many-lights.md). With fewer, all choices are made by the table of all lights.
constexpr std::ptrdiff_t kTreeFrom = 32;
// Every kTableShare-th of the random words that choose among the lights of the tree uses the table of all
// lights instead of the tree. So each of these lights keeps at least 1/16 of its probability in the table.
constexpr std::uint64_t kTableShare = 16;

// Returns the scale of the map from the group's space to the world, for a map that keeps angles, at time 0.
double scale_of(const PlacedInstance& placed) { return std::cbrt(std::abs(placed.to_world.determinant())); }

// Returns the reach (SurfaceHit::reach), in the group's space, of points whose errors are those of rays in
// the world: coordinates of the world are at most 1, but for those of its centre, and the map to the group's
// space adds four products of such coordinates (geometry.cpp, reach_of()).
float reach_in_group(const Geometry& g, std::uint32_t instance) {
  double least = kInfinity;
  for (const MotionKey& key : g.moving[g.instances[instance].moving].motion().keys())
    least = std::min(
        least, std::cbrt(std::abs(g.moving[g.instances[instance].moving].to_world(key.time).determinant())));
  return static_cast<float>(4 / least);
}

LightSample moved(LightSample s, const PlacedInstance& placed, const V3& x) {
  s.direction = normalize(V3(placed.to_world.vector(V3d(s.direction))));
  s.target = V3(placed.to_world.point(V3d(s.target)));
  const V3 way = s.target - x;
  s.distance = std::sqrt(dot(way, way));
  return s;
}

// Returns the part of a hit that the lights' densities depend on, in the group's space.
SurfaceHit hit_in_group(const SurfaceHit& hit, const PlacedInstance& placed) {
  SurfaceHit local = hit;
  local.p = V3(placed.to_local.point(V3d(hit.p)));
  local.ng = normalize(V3(placed.to_local.vector(V3d(hit.ng))));
  return local;
}

}  // namespace

template <class Kind>
void Lights::add(Kind kind) {
  if (kind.dark(world()))
    ++left_out_;
  else
    lights_.push_back({.kind = std::move(kind)});
}
template <class... Kind>
void Lights::add(std::variant<Kind...> kind) {
  std::visit([&](auto& k) { add(std::move(k)); }, kind);
}

void Lights::add_area(const Scene& scene, std::uint32_t shape, const SurfacePrimitives& primitives,
                      Geometry& g) {
  const auto lights = static_cast<std::uint32_t>(lights_.size());
  const std::uint32_t instance = g.instance_of_shape[shape];
  const auto finish = [&](auto& l) {
    const LightBounds box = l.bounds(world());
    l.reach = std::max(largest(box.low), largest(box.high));
    if (instance != kNone) l.reach = std::max(l.reach, reach_in_group(g, instance));
    // If the light's surface is null or hidden (some light passes straight through it), other surfaces may
    // coincide with it. Shadow rays must then end in front of all of these surfaces.
    if (g.surfaces[shape].passable) l.reach = std::max(l.reach, g.surfaces[shape].coincident_reach);
    add(std::move(l));
  };
  auto light = make_area_light(scene.shapes[shape], shape, primitives, world());
  std::visit(finish, light);
  if (lights_.size() == lights) return;
  g.surfaces[shape].light = lights;
  lights_.back().instance = instance;
}

Result<void> Lights::add_map(const Scene& scene, const EnvmapEmitter& emitter, const ImageLoader& images) {
  if (map_) return fail(Errc::invalid_argument, "a scene has one environment map at most");
  if (emitter.file.value >= scene.assets.size() || !images)
    return fail(Errc::invalid_argument, "an environment map names a file that the scene does not have");
  const Asset& asset = scene.assets[emitter.file.value];
  auto image = images(asset);
  if (!image) return tl::unexpected(image.error());
  auto map = EnvironmentMap::build(asset.name, with_colours(std::move(*image), emitter.colours),
                                   emitter.scale, emitter.to_world, emitter.mapping);
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
                             const ImageLoader& images, std::span<const std::string> light_groups) {
  Lights l;
  const scene::LinkLists lists(scene);
  const auto reach_of = [&](RayKinds hidden, const LightLinks& links) {
    return LightReach{hidden, lists.index(links.receivers), lists.index(links.blockers)};
  };
  // Sets the group and the reach of the lights from `first` on.
  const auto mark = [&](std::size_t first, const std::string& name, const LightReach& reach) {
    const LightGroup group = light_group_of(light_groups, name);
    for (std::size_t light = first; light < l.lights_.size(); ++light) {
      l.lights_[light].group = group;
      l.lights_[light].reach = reach;
    }
    return group;
  };
  l.geometry_ = &geometry;
  l.textures_ = &textures;
  const SurfacePrimitives primitives(geometry);
  for (std::uint32_t i = 0; i < scene.shapes.size(); ++i) {
    const auto& emitter = scene.shapes[i].emitter;
    if (!emitter) continue;
    const auto first = l.lights_.size();
    l.add_area(scene, i, primitives, geometry);
    mark(first, emitter->light_group, reach_of(hidden_from(scene.shapes[i]), emitter->links));
  }
  for (const Emitter& e : scene.emitters) {
    const auto first = l.lights_.size();
    if (auto ok = l.add_emitter(scene, e, images); !ok) return tl::unexpected(ok.error());
    std::visit(
        [&]<class E>(const E& any) {
          const LightReach reach = reach_of(hidden_from(any), any.links);
          const LightGroup group = mark(first, any.light_group, reach);
          if constexpr (std::is_same_v<E, ConstantEmitter> || std::is_same_v<E, EnvmapEmitter>) {
            l.sky_group_ = group;
            l.sky_reach_ = reach;
          }
        },
        e);
  }
  l.sort_places_first();
  l.set_probabilities();
  if (scene.integrator.light_tree == 0) l.build_tree();
  return l;
}

double Lights::power(const Light& light) const {
  const double power = with_kind(light.kind, [&](const auto& l) { return double{l.power(world())}; });
  return light.instance == kNone ? power : power * sqr(scale_of(geometry_->instances[light.instance]));
}

LightBounds Lights::bounds(const Light& light) const {
  LightBounds b = with_kind(light.kind, [&](const auto& l) -> LightBounds {
    if constexpr (std::decay_t<decltype(l)>::kHasPlace)
      return l.bounds(world());
    else
      __builtin_unreachable();
  });
  if (light.instance == kNone) return b;
  const PlacedInstance& placed = geometry_->instances[light.instance];
  const Box box = geometry_->moving[placed.moving].box({V3d(b.low), V3d(b.high)}, 0, 1);
  LightBounds all;  // whose normals have all directions
  all.low = V3(box.lo), all.high = V3(box.hi);
  all.cos_reach = b.cos_reach;
  all.intensity = b.intensity * sqr(scale_of(placed));
  return all;
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

std::vector<scene::LinkIndex> Lights::blockers_of_extended() const {
  std::vector<scene::LinkIndex> lists{sky_reach_.blockers};
  for (const Light& l : lights_)
    if (!is_point(l) && !std::holds_alternative<DirectionalLight>(l.kind)) lists.push_back(l.reach.blockers);
  std::ranges::sort(lists);
  lists.erase(std::ranges::unique(lists).begin(), lists.end());
  std::erase(lists, scene::kEverything);
  return lists;
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

Pivot Lights::pivot(const LightChoice& choice, const Moment& moment) const {
  const std::uint32_t instance = lights_[choice.light].instance;
  const Pivot own = pivot(choice);
  return instance == kNone ? own : Pivot(V3(moment.placed(instance).to_world.point(V3d(own.p))));
}

std::optional<LightSample> Lights::sample(const LightChoice& c, const V3& x, const Moment& moment) const {
  const std::uint32_t instance = lights_[c.light].instance;
  if (instance == kNone) return sample(c, x);
  const PlacedInstance& placed = moment.placed(instance);
  const auto own = sample(c, V3(placed.to_local.point(V3d(x))));
  return own ? std::optional(moved(*own, placed, x)) : std::nullopt;
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

float Lights::pdf(const SurfaceHit& hit, const V3& x, const V3& direction, const LightPlace& place,
                  bool before_point, const Moment& moment) const {
  const std::uint32_t light = geometry_->surfaces[hit.surface].light, instance = lights_[light].instance;
  if (instance == kNone) return pdf(hit, x, direction, place, before_point);
  const float p =
      before_point && !by_place(place) ? lights_[light].probability : probability_at(light, place);
  const PlacedInstance& placed = moment.placed(instance);
  const SurfaceHit own = hit_in_group(hit, placed);
  const V3 from(placed.to_local.point(V3d(x))), d = normalize(V3(placed.to_local.vector(V3d(direction))));
  return with_area(hit, [&](const auto& l) { return l.pdf(world(), own, from, d, p); });
}

Pivot Lights::pivot(const SurfaceHit& hit, const Moment& moment) const {
  const std::uint32_t instance = lights_[geometry_->surfaces[hit.surface].light].instance;
  if (instance == kNone) return pivot(hit);
  const PlacedInstance& placed = moment.placed(instance);
  return V3(placed.to_world.point(V3d(pivot(hit_in_group(hit, placed)).p)));
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
    lights_.push_back({.kind = sky_, .group = sky_group_, .reach = sky_reach_});
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
  EnvironmentParts parts{.unsampled = environment_, .sampled = C3(0), .pdf = 0};
  if (sky_.sampled()) {
    const EnvironmentMap::Light light = sky_.from(x, direction);
    parts.sampled = light.radiance;
    parts.pdf = light.pdf * probability_at(sky_index_, place);
    parts.group = sky_group_;
  } else if (!suns_.empty()) {
    const SunLight& only = sun(suns_.front());
    parts.sampled = only.found(direction, kInfinity, 1);
    parts.pdf = only.density * probability_at(suns_.front(), place);
    parts.group = group(suns_.front());
  }
  return parts;
}

bool Lights::hides_environment() const {
  return sky_reach_.hidden.has(RayKind::camera) ||
         std::ranges::any_of(suns_, [&](std::uint32_t i) { return !sun(i).seen; });
}

C3 Lights::environment_seen(const V3& direction) const {
  C3 sum = sky_reach_.hidden.has(RayKind::camera) ? C3(0) : environment_ + sky_.radiance(direction);
  for (const std::uint32_t i : suns_)
    if (sun(i).seen) sum += sun(i).found(direction, kInfinity, 1);
  return sum;
}

C3 Lights::suns(const V3& direction, float pdf, const LightPlace& place) const {
  C3 sum(0);
  for (const std::uint32_t i : suns_) sum += sun(i).found(direction, pdf, probability_at(i, place));
  return sum;
}

// A light is chosen by the table of all lights or, if the shaded point is known, by the tree or by the
// probabilities learned for the point's place. Each of the three maps a word, a random integer of 32 bits, to
// a light.

bool Lights::enough_for_tree() const {
  return std::count_if(lights_.begin(), lights_.end(), has_place) >= kTreeFrom;
}

// Moves the lights with a position to the front of the list, where build_tree() expects them, unless they are
// too few for a tree. Area lights have a position and are already first, so their order does not change.
void Lights::sort_places_first() {
  if (!enough_for_tree()) return;
  std::stable_partition(lights_.begin(), lights_.end(), has_place);
}

void Lights::build_tree() {
  std::vector<LightBounds> all;
  for (const Light& light : lights_) {
    if (!has_place(light)) break;
    LightBounds b = bounds(light);
    b.intensity = std::isfinite(b.intensity) ? std::clamp(b.intensity, 1e-30, 1e30) : 1e30;
    all.push_back(b);
  }
  if (static_cast<std::ptrdiff_t>(all.size()) < kTreeFrom || all.size() > LightTree::kMaxLights) return;
  tree_ = LightTree::build(all);
  tree_words_ = std::uint64_t{last_[all.size() - 1]} + 1;
  table_words_ = (tree_words_ + kTableShare - 1) / kTableShare;
}

// The probability of each of the n lights is half its share of the power plus half of 1/n, so none is below
// 1/(2n). Probabilities are exact shares of the 2^32 random words.
void Lights::set_probabilities() {
  last_.clear();
  suns_.clear();
  any_with_place_ = false;
  std::vector<double> p;
  double sum = 0;
  for (const Light& l : lights_) sum += p.emplace_back(std::max(0., power(l)));
  alone_ = p.size() == 1;
  const double uniform = .5 / static_cast<double>(p.size());
  for (double& x : p) x = (sum > 0 && std::isfinite(sum) ? .5 * x / sum : uniform) + uniform;
  append_light_table(p, last_);
  for (std::size_t i = 0; i < p.size(); ++i) {
    lights_[i].probability = probability_in_table(last_, static_cast<std::uint32_t>(i));
    any_with_place_ = any_with_place_ || has_place(lights_[i]);
    if (std::holds_alternative<SunLight>(lights_[i].kind)) suns_.push_back(static_cast<std::uint32_t>(i));
    if (std::holds_alternative<SkyLight>(lights_[i].kind)) sky_index_ = static_cast<std::uint32_t>(i);
  }
}

double Lights::spread_over(const LightVisits& visits) const {
  double sum = 0;
  for (std::size_t i = 0; i < visits.values.size(); ++i) {
    const double v = double{visits.values[i]};
    sum += v * v / double{lights_[i % lights_.size()].probability};
  }
  return visits.places.empty() ? 0 : sum / static_cast<double>(visits.places.size());
}

void Lights::set_local(const LightVisits* visits) {
  local_ = nullptr;
  if (!visits) return;
  std::vector<double> table;
  for (const Light& light : lights_) table.push_back(double{light.probability});
  local_ = std::make_unique<const LocalLights>(*visits, table);
}

std::uint64_t Lights::table_bytes() const {
  std::uint64_t n = lights_.size() * sizeof(Light) + last_.size() * sizeof(last_[0]);
  if (local_) n += local_->bytes();
  for (const Light& light : lights_)
    n += with_kind(light.kind, [](const auto& l) { return l.extra_bytes(); });
  return n;
}

DrawnLight Lights::by_table(std::uint32_t word) const {
  const std::uint32_t i = light_of_word(last_, word);
  return {i, lights_[i].probability};
}

// Returns how many of the words below table_words_ choose light i. A word w below table_words_ chooses the
// light that the table assigns to the word kTableShare * w.
std::uint64_t Lights::table_words(std::uint32_t i) const {
  const std::uint64_t first = i == 0 ? 0 : std::uint64_t{last_[i - 1]} + 1, end = std::uint64_t{last_[i]} + 1;
  return (end + kTableShare - 1) / kTableShare - (first + kTableShare - 1) / kTableShare;
}

DrawnLight Lights::draw(std::uint32_t word, const LightPlace& place) const {
  if (by_place(place)) return local_->draw(word, place.p, place.n);
  return by_tree(place) ? from_tree(word, place) : by_table(word);
}

DrawnLight Lights::from_tree(std::uint32_t word, const LightPlace& place) const {
  if (word >= tree_words_) return draw(word);
  const std::uint64_t words = tree_words_ - table_words_;
  if (word >= table_words_) {
    const LightTree::Found found = tree_.find(word - table_words_, words, place.p, place.n);
    return {found.light, probability_of_words(found.words + table_words(found.light))};
  }
  const std::uint32_t i = draw(static_cast<std::uint32_t>(word * kTableShare)).light;
  return {i, probability_of_words(tree_.words_of(i, words, place.p, place.n) + table_words(i))};
}

float Lights::probability_at(std::uint32_t i, const LightPlace& place) const {
  if (by_place(place)) return local_->probability(i, place.p, place.n);
  if (!by_tree(place) || !has_place(lights_[i])) return lights_[i].probability;
  return probability_of_words(tree_.words_of(i, tree_words_ - table_words_, place.p, place.n) +
                              table_words(i));
}

}  // namespace ls::render
