// The lights of a world: how they are chosen and sampled, and with which densities.
//
// A light with a position has a pivot: the point about which a segment of a path is sampled equi-angularly
// (equiangular.h). The pivot of an area light is the point that is sampled on it. For a sphere it is the
// centre, because the point on a sphere is sampled only once the vertex on the segment is known. Spots and
// projectors light only a part of a segment, to which the samples are limited.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "worker/render/base/light_group.h"
#include "worker/render/base/light_reach.h"
#include "worker/render/lights/area.h"
#include "worker/render/lights/distant.h"
#include "worker/render/lights/local_lights.h"
#include "worker/render/lights/punctual.h"

namespace ls::render {

// The chosen light, the probability with which it was chosen, and, for area lights, the numbers that
// determine the point on it.
struct LightChoice {
  std::uint32_t light = 0;
  float probability = 0;
  bool has_place = false, is_point = false;  // is_point: has a position but no extent
  LightNumbers numbers;
};

// The place for which a light is chosen: a point on a surface and its normal or, with n = 0, a point in a
// medium. If learned probabilities (LocalLights) choose lights in media, all points of a path's segment have
// the same place (Lights::place_on), but for the vertex whose light several pixels share (path_reuse.h).
struct LightPlace {
  V3 p{0, 0, 0}, n{0, 0, 0};
};

class Lights {
 public:
  // Builds the list of the scene's lights and sets the light index of the surfaces of `geometry`. Lights
  // without power or area are left out and counted. `images` loads environment maps; it may be empty if the
  // scene has no environment map. `light_groups` are the names of the light groups, sorted.
  static Result<Lights> build(const Scene& scene, Geometry& geometry, const TextureTable& textures,
                              const ImageLoader& images = {}, std::span<const std::string> light_groups = {});

  // Returns the light group of a light, of the surface light that was hit, and of the environment map or the
  // constant environment.
  LightGroup group(std::uint32_t light) const { return lights_[light].group; }
  LightGroup group(const SurfaceHit& hit) const { return group(geometry_->surfaces[hit.surface].light); }
  LightGroup sky_group() const { return sky_group_; }
  // Returns the receivers and blockers of a light, and of the environment map and the constant environment.
  const LightReach& reach(std::uint32_t light) const { return lights_[light].reach; }
  const LightReach& sky_reach() const { return sky_reach_; }
  // The lists of blockers of the lights that rays can hit, each once, without kEverything.
  std::vector<scene::LinkIndex> blockers_of_extended() const;

  // False if there is no light that next-event estimation can sample.
  bool can_sample() const { return !lights_.empty(); }
  bool any_with_place() const { return any_with_place_; }
  std::vector<V3> points() const;  // positions of all lights without extent, the most powerful first
  // True if next-event estimation samples lights without a position: distant lights, suns, the sky.
  bool any_without_place() const;
  // The strongest light with a single direction: its irradiance on a plane that faces it, and its direction
  // of travel. `light` is kNone if there is no such light.
  struct Directional {
    std::uint32_t light = kNone;
    V3 direction{0, 0, 1};
    C3 irradiance{0, 0, 0};
  };
  Directional strongest_directional() const;
  // Chooses a light before the shaded point is known: with probability 1/2 in proportion to power, else
  // uniformly.
  LightChoice choose(const LightNumbers& numbers) const { return chosen(numbers, draw(numbers.light)); }
  // Chooses a light for a place: by the probabilities learned for this place (local_lights.h) or, if none
  // were learned and there are many lights, by a tree (light_tree.h).
  LightChoice choose(const LightNumbers& numbers, const LightPlace& place) const {
    return chosen(numbers, alone_ ? only_one() : draw(numbers.light, place));
  }
  // Chooses a light for a segment in a medium, before the point on the segment is known.
  LightChoice choose_before_point(const LightNumbers& numbers, const LightPlace& place) const {
    return by_place(place) ? choose(numbers, place) : choose(numbers);
  }
  // The place of a segment in a medium, for choosing lights by place: its middle, or its start if it is
  // infinite.
  static V3 place_on(const V3& start, const V3& direction, float length) {
    return std::isfinite(length) ? start + direction * (length / 2) : start;
  }
  bool local_in_media() const { return local_ && local_->in_media(); }
  // The pivot of the chosen light, which must have a position.
  Pivot pivot(const LightChoice& choice) const;
  Pivot pivot(const LightChoice& choice, const Moment& moment) const;
  // Samples the light that arrives at x from the chosen light. Returns nullopt if no light can arrive: if x
  // is behind the light or outside its cone, or if the light has zero solid angle.
  std::optional<LightSample> sample(const LightChoice& choice, const V3& x) const;
  // This function and the others with a `moment` are for scenes with shapes that move. The others take all
  // lights for such that stand still.
  std::optional<LightSample> sample(const LightChoice& choice, const V3& x, const Moment& moment) const;

  // The radiance that a surface light emits at `hit` in the direction w, which points from the surface to the
  // viewer.
  C3 emitted(const SurfaceHit& hit, const V3& w) const;
  // Density, per steradian at x and including the choice of the light, with which sample() finds the point
  // `hit` of a surface light after choose(numbers, place) or, if `before_point`, after choose_before_point().
  // `direction` points from x to the hit.
  float pdf(const SurfaceHit& hit, const V3& x, const V3& direction, const LightPlace& place = {},
            bool before_point = false) const;
  float pdf(const SurfaceHit& hit, const V3& x, const V3& direction, const LightPlace& place,
            bool before_point, const Moment& moment) const;
  Pivot pivot(const SurfaceHit& hit) const;
  Pivot pivot(const SurfaceHit& hit, const Moment& moment) const;
  // Returns the radiance of the environment for a path that leaves the scene from x in this direction (a unit
  // vector), weighted against next-event estimation at x, which chooses a light by `place`. `pdf` is the
  // density, per steradian, with which the path sampled the direction. If `pdf` is infinite, the full
  // radiance is returned; this is for directions that were not sampled. Without portals a constant
  // environment is never sampled as a light, since it is smooth and paths find it when they leave.
  C3 environment(const V3& x, const V3& direction, float pdf, const LightPlace& place) const {
    const C3 beside = suns_.empty() ? environment_ : environment_ + suns(direction, pdf, place);
    return sky_.sampled() ? beside + sky(x, direction, pdf, place) : beside;
  }
  // Calls f(group, radiance) for each part of environment() that belongs to one light: the sky, and each sun
  // in this direction.
  template <class F>
  void environment_by_group(const V3& x, const V3& direction, float pdf, const LightPlace& place, F f) const {
    f(sky_group_, sky_.sampled() ? environment_ + sky(x, direction, pdf, place) : environment_);
    for (const std::uint32_t i : suns_) f(group(i), sun(i).found(direction, pdf, probability_at(i, place)));
  }
  // The same with a `pdf` of each part: pdf_of(reach), an optional; nullopt: the part does not count.
  template <class PdfOf, class F>
  void environment_by_reach(const V3& x, const V3& direction, const PdfOf& pdf_of, const LightPlace& place,
                            F f) const {
    if (const std::optional<float> pdf = pdf_of(sky_reach_))
      f(sky_group_, sky_.sampled() ? environment_ + sky(x, direction, *pdf, place) : environment_);
    for (const std::uint32_t i : suns_)
      if (const std::optional<float> pdf = pdf_of(reach(i)))
        f(group(i), sun(i).found(direction, *pdf, probability_at(i, place)));
  }
  // The radiance that a camera ray sees if it leaves the scene in this direction without a scattering: that
  // of the lights whose visible_camera is true.
  C3 environment_seen(const V3& direction) const;
  // Calls f(group, radiance) for each of these lights.
  template <class F>
  void environment_seen_by_group(const V3& direction, F f) const {
    if (!sky_reach_.hidden.has(RayKind::camera)) f(sky_group_, environment_ + sky_.radiance(direction));
    for (const std::uint32_t i : suns_)
      if (sun(i).seen) f(group(i), sun(i).found(direction, kInfinity, 1));
  }
  bool hides_environment() const;  // true if visible_camera of one of these lights is false
  // The radiance of the constant environment; black while portals are set, since the constant environment is
  // then a part of the sky, which is sampled as a light.
  const C3& constant_environment() const { return environment_; }
  // The environment radiance, split by whether next-event estimation samples it. Requires
  // single_environment_sample().
  struct EnvironmentParts {
    C3 unsampled;  // never sampled as a light
    C3 sampled;    // sampled as a light with the density `pdf`, per steradian
    float pdf;
    LightGroup group = kNoLightGroup;  // of `sampled`
  };
  EnvironmentParts environment_parts(const V3& x, const V3& direction, const LightPlace& place) const;
  // True if next-event estimation samples a direction by at most one light that paths can also hit when they
  // leave the scene: a sun with an extent, or the sky.
  bool single_environment_sample() const { return suns_.size() + (sky_.sampled() ? 1 : 0) <= 1; }
  // Sets the radiance of the constant environment and returns the previous one, which is black if there was
  // no constant environment.
  C3 exchange_constant_environment(const C3& radiance) { return std::exchange(environment_, radiance); }
  bool has_sky() const { return sky_.sampled() || !is_black(environment_); }  // light from all directions
  bool has_environment() const { return has_sky() || !suns_.empty(); }
  const EnvironmentMap* map() const { return map_.get(); }
  bool is_sky(const LightChoice& choice) const;
  // From this call on, directions towards the environment map and the constant environment are also sampled
  // through these portals. A null pointer removes the portals.
  void set_portals(std::unique_ptr<const Portals> portals);
  const Portals* portals() const { return portals_.get(); }

  // From this call on, the tree (if there is one) also chooses lights for points in media. Integrators that
  // sample points on segments must not call this, because they choose the light before they know the point.
  void use_tree_in_media() { tree_in_media_ = true; }
  bool has_tree() const { return !tree_.empty(); }
  std::size_t in_tree() const { return tree_.lights(); }  // number of lights in the tree
  bool enough_for_tree() const;                           // true if enough lights have a position
  // True if lights are chosen by the tree at some places. `media` is true if the scene has media.
  bool uses_tree(bool media) const {
    return has_tree() && (!local_ || (media && tree_in_media_ && !local_in_media()));
  }
  // True if set_local() may be called.
  bool can_be_local() const { return lights_.size() > 1 && lights_.size() <= LocalLights::kMostLights; }
  // How noisy the table's choice of a light is at the places of `visits`: the mean square of next-event
  // estimation over the square of its mean. It is at least 1, and is 1 where each light contributes in
  // proportion to its probability in the table. 0 if there are no places.
  double spread_over(const LightVisits& visits) const;
  // From this call on, lights are chosen by probabilities learned from these visits. A null pointer ends
  // this.
  void set_local(const LightVisits* visits);
  const LocalLights* local() const { return local_.get(); }
  // This light, as if it had been chosen with this probability.
  LightChoice choice_of(std::uint32_t light, float probability, const LightNumbers& numbers) const {
    return chosen(numbers, {light, probability});
  }
  std::uint64_t tree_bytes() const { return tree_.bytes(); }
  std::uint64_t table_bytes() const;
  std::uint64_t map_bytes() const;  // memory of the environment map and of the portals

  std::size_t count() const { return lights_.size(); }
  std::uint64_t left_out() const { return left_out_; }
  std::uint64_t clamped_inputs() const { return clamped_; }  // number of negative texels that were set to 0

 private:
  struct Light {
    VariantOf<AreaKinds, PunctualKinds, DistantKinds> kind;
    float probability = 0;
    LightGroup group = kNoLightGroup;
    LightReach reach{};
    // The instance of a light whose shape moves. Such a light is in the space of its group, which keeps the
    // angles of the world.
    std::uint32_t instance = kNone;
  };

  static bool has_place(const Light& light) {
    return with_kind(light.kind, [](const auto& l) { return l.kHasPlace; });
  }
  static bool is_point(const Light& light) {
    return with_kind(light.kind, [](const auto& l) { return l.kIsPoint; });
  }
  LightWorld world() const { return {*geometry_, *textures_}; }
  // Calls f with the area light of the surface that was hit.
  template <class F>
  auto with_area(const SurfaceHit& hit, F f) const {
    using Answer = std::invoke_result_t<F, const SphereLight&>;
    return with_kind(lights_[geometry_->surfaces[hit.surface].light].kind, [&](const auto& l) -> Answer {
      if constexpr (std::decay_t<decltype(l)>::kIsArea)
        return f(l);
      else
        __builtin_unreachable();  // only area lights have surfaces
    });
  }

  template <class Kind>
  void add(Kind kind);
  template <class... Kind>
  void add(std::variant<Kind...> kind);
  void add_area(const Scene& scene, std::uint32_t shape, const SurfacePrimitives& primitives, Geometry& g);
  Result<void> add_emitter(const Scene& scene, const Emitter& emitter, const ImageLoader& images);
  Result<void> add_map(const Scene& scene, const EnvmapEmitter& emitter, const ImageLoader& images);
  void set_probabilities();
  void sort_places_first();
  void build_tree();
  double power(const Light& light) const;
  LightBounds bounds(const Light& light) const;
  static bool on_surface(const LightPlace& place) { return dot(place.n, place.n) > 0; }
  bool by_place(const LightPlace& place) const { return local_ && (local_->in_media() || on_surface(place)); }
  bool by_tree(const LightPlace& place) const {
    return !tree_.empty() && (tree_in_media_ || on_surface(place));
  }
  DrawnLight only_one() const { return {0, lights_.front().probability}; }
  DrawnLight draw(std::uint32_t word) const { return alone_ ? only_one() : by_table(word); }
  DrawnLight draw(std::uint32_t word, const LightPlace& place) const;
  DrawnLight by_table(std::uint32_t word) const;
  DrawnLight from_tree(std::uint32_t word, const LightPlace& place) const;
  float probability_at(std::uint32_t light, const LightPlace& place) const;
  std::uint64_t table_words(std::uint32_t light) const;
  LightChoice chosen(const LightNumbers& numbers, const DrawnLight& drawn) const {
    const Light& light = lights_[drawn.light];
    return {drawn.light, drawn.probability, has_place(light), is_point(light), numbers};
  }
  const SunLight& sun(std::uint32_t i) const { return *std::get_if<SunLight>(&lights_[i].kind); }
  C3 suns(const V3& direction, float pdf, const LightPlace& place) const;
  // The part of environment() that next-event estimation samples by directions of the sky.
  C3 sky(const V3& x, const V3& direction, float pdf, const LightPlace& place) const {
    if (std::isinf(pdf)) return sky_.radiance(direction);
    const EnvironmentMap::Light light = sky_.from(x, direction);
    const float as_light = light.pdf * probability_at(sky_index_, place);
    return as_light > 0 ? light.radiance * (1 / (1 + as_light / pdf)) : light.radiance;
  }

  std::vector<Light> lights_;
  std::vector<std::uint32_t> suns_;  // indices of the suns in lights_
  // Light i is chosen by the words from last_[i - 1] + 1 to last_[i]. The number of these words divided by
  // 2^32 is exactly its probability.
  std::vector<std::uint32_t> last_;
  bool alone_ = false;  // true for a single light, which needs no choice
  const Geometry* geometry_ = nullptr;
  const TextureTable* textures_ = nullptr;
  C3 environment_{0, 0, 0};
  std::unique_ptr<const EnvironmentMap> map_;
  std::unique_ptr<const Portals> portals_;
  SkyLight sky_;                 // a copy of the SkyLight in lights_, if there is one
  std::uint32_t sky_index_ = 0;  // index of that SkyLight in lights_
  // If there are many lights, those with a position come first in the list and are in the tree. The first
  // words of the table choose these lights; at each point the tree redistributes these words among them,
  // except every kTableShare-th word, which the table keeps.
  LightTree tree_;
  std::unique_ptr<const LocalLights> local_;
  std::uint64_t tree_words_ = 0, table_words_ = 0;
  bool tree_in_media_ = false;
  bool any_with_place_ = false;
  LightGroup sky_group_ = kNoLightGroup;
  LightReach sky_reach_;  // of the environment map or the constant environment
  std::uint64_t left_out_ = 0, clamped_ = 0;
};

}  // namespace ls::render
