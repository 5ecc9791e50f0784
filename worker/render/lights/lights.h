// The lights of a world: how they are chosen and sampled, and with which densities.
//
// A light with a position has a pivot: the point about which a segment of a path is sampled equi-angularly
// (equiangular.h). The pivot of an area light is the point that is sampled on it. For a sphere it is the
// centre, because the point on the sphere is sampled only once the vertex on the segment is known.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/base/built.h"
#include "worker/render/geometry/geometry.h"
#include "worker/render/lights/envmap.h"
#include "worker/render/lights/light_tree.h"
#include "worker/render/math/math.h"
#include "worker/render/texture/texture.h"

namespace ls::render {

struct LightSample {
  V3 direction;        // unit, from the shaded point towards the light
  float distance = 0;  // to the light along it; infinity for distant lights
  // The point sampled on the light, moved off its surface: shadow rays end there. Not set for distant lights.
  V3 target{0, 0, 0};
  C3 radiance;  // arriving if unobstructed; for delta lights the irradiance on a plane facing it
  // The density of `direction` per steradian, including the probability of choosing the light. For delta
  // lights it is the probability of choosing the light alone.
  float pdf = 0;
  bool delta = false;
};

// Random words for choosing a light and a point on it. All 32 bits of each are used, because among many
// lights or triangles the last bits decide.
struct LightNumbers {
  std::uint32_t light = 0, x = 0, y = 0;
};

// The chosen light, the probability with which it was chosen, and, for area lights, the numbers that
// determine the point on it.
struct LightChoice {
  std::uint32_t light = 0;
  float probability = 0;
  bool has_place = false, is_point = false;  // is_point: a position without extent
  LightNumbers numbers;
};

class Lights {
 public:
  // Builds the list of the scene's lights and sets the light index of the surfaces of `geometry`. Lights
  // without power or area are left out and counted. `images` loads environment maps; scenes without one do
  // not need it.
  static Result<Lights> build(const Scene& scene, Geometry& geometry, const TextureTable& textures,
                              const ImageLoader& images = {});

  // False if there is no light that next-event estimation can sample.
  bool can_sample() const { return !lights_.empty(); }
  bool any_with_place() const { return any_with_place_; }
  std::vector<V3> points() const;  // positions of all lights without extent, the most powerful first
  // True if there are lights without a position that next-event estimation samples: distant ones, suns, maps.
  bool any_without_place() const;
  // Chooses a light before the shaded point is known: with probability 1/2 in proportion to power, else
  // uniformly.
  LightChoice choose(const LightNumbers& numbers) const { return chosen(numbers, draw(numbers.light)); }
  // Chooses a light for the point x on a surface of normal n, or in a medium (n = 0). If there are many
  // lights, they are chosen by a tree (light_tree.h).
  LightChoice choose(const LightNumbers& numbers, const V3& x, const V3& n) const {
    return chosen(numbers, alone_ ? only_one() : draw(numbers.light, x, n));
  }
  // The pivot of the chosen light, which must have a position.
  V3 pivot(const LightChoice& choice) const;
  // Samples the light that arrives at x from the chosen light. Returns nullopt if none can arrive: if x is
  // behind the light or outside its cone, or if the light has zero solid angle.
  std::optional<LightSample> sample(const LightChoice& choice, const V3& x) const;

  // The radiance that a surface light emits at `hit` in the direction w, which points from the surface to the
  // viewer.
  C3 emitted(const SurfaceHit& hit, const V3& w) const;
  // Density, per steradian at x and including the choice of the light, with which choose(numbers, x, n) and
  // sample() find the point `hit` of a surface light. `direction` points from x to the hit.
  float pdf(const SurfaceHit& hit, const V3& x, const V3& direction, const V3& n = V3(0)) const;
  V3 pivot(const SurfaceHit& hit) const;
  // Environment radiance for a path that leaves the scene in this direction (a unit vector), weighted against
  // sampling it as a light. `pdf` is the density, per steradian, with which the path sampled the direction.
  // Infinity gives the full radiance, for directions that were not sampled. A constant environment is never
  // sampled: it is smooth, and paths that leave find it.
  C3 environment(const V3& direction, float pdf) const {
    const C3 beside = suns_.empty() ? environment_ : environment_ + suns(direction, pdf);
    if (!kBuilt.environment_maps || !map_) return beside;
    const EnvironmentMap::Light light = map_->at(direction);
    const float as_light = light.pdf * map_probability_;
    return beside + (as_light > 0 ? light.radiance * (1 / (1 + as_light / pdf)) : light.radiance);
  }
  bool has_environment() const { return map_ || !suns_.empty() || !is_black(environment_); }
  const EnvironmentMap* map() const { return map_ ? &*map_ : nullptr; }

  // From this call on, lights are chosen by the tree for points in media too, if there is a tree. For
  // integrators that do not sample points on segments.
  void use_tree_in_media() { tree_in_media_ = true; }
  bool has_tree() const { return !tree_.empty(); }
  std::uint64_t tree_bytes() const { return tree_.bytes(); }
  std::uint64_t table_bytes() const;

  std::size_t count() const { return lights_.size(); }
  std::uint64_t left_out() const { return left_out_; }
  std::uint64_t clamped_inputs() const { return clamped_; }  // negative texels set to 0

 private:
  enum class Kind {
    parallelogram,
    mesh,
    sphere,
    disk,
    cylinder,
    directional,
    sun,
    point,
    spot,
    projector,
    map
  };
  struct Drawn {
    std::uint32_t light;
    float probability;
  };
  static bool has_place(Kind kind) {
    return kind != Kind::directional && kind != Kind::sun && kind != Kind::map;
  }
  static bool is_point(Kind kind) {
    return kind == Kind::point || kind == Kind::spot || kind == Kind::projector;
  }
  struct Light {
    Kind kind = Kind::point;
    // The strength of the light. For point and spot it is the intensity; for directional the irradiance; for
    // projector the irradiance on the plane at distance 1 for a texture of 1; for sun and uniform area lights
    // the radiance.
    C3 value;
    TextureIndex radiance;  // texture of area lights; projected texture of spot, projector
    bool textured = false;
    bool beam = false;     // area lights: radiance depends on the angle
    bool uniform = false;  // area lights: neither textured nor a beam
    // For a parallelogram: its corner and edges. For a disk: its centre and axes. For directional: the
    // direction of travel.
    V3 position, axis_u, axis_v, normal;
    V2 uv0, uv_u, uv_v;  // parallelogram: uv at the corner and along the edges
    double area = 0;
    std::uint32_t primitive = 0;  // index of the sphere or cylinder; mesh: first triangle
    std::vector<double> cdf;      // mesh: over triangle areas
    float sign = 1;               // orientation of the emitting side
    float reach = 1;              // area lights: the largest coordinate of any point on it
    float cos_cutoff = 0, cos_beam = 0, cutoff = 0, inv_transition = 0, tan_cutoff = 0;  // spot
    float falloff = 1;  // beam: exponent, used with cos_cutoff, cos_beam and, in cosines, inv_transition
    float tan_x = 0, tan_y = 0;       // projector: tangents of half its fields of view
    float cone = 0, sun_density = 0;  // sun: 1 - cos of its angular radius; 1 / solid angle
    float probability = 0;
  };
  struct Point {  // on an area light
    V3 p, n;
    V2 uv{0, 0};  // only for textured lights
    FacePoint face;
  };

  // The index range of the primitives of one shape in Geometry's lists, in which they are contiguous.
  struct Range {
    std::uint32_t first = kNone, count = 0;
  };
  struct Primitives {
    std::vector<Range> triangles, spheres, disks, cylinders;  // by surface
  };

  static Primitives primitives_of(const Geometry& geometry);
  void add_area(const Scene& scene, std::uint32_t shape, const Primitives& primitives, Geometry& geometry);
  Result<void> add_emitter(const Scene& scene, const Emitter& emitter, const ImageLoader& images);
  Result<void> add_map(const Scene& scene, const EnvmapEmitter& emitter, const ImageLoader& images);
  static void set_sun(Light& light, double degrees);
  void set_projector(Light& light, const ProjectorEmitter& emitter);
  static void set_beam(Light& light, const AreaEmitter& emitter);
  void set_probabilities(float scene_radius);
  void sort_places_first();
  void build_tree();
  LightBounds bounds(const Light& light) const;
  LightBounds shape_bounds(const Light& light) const;
  LightBounds mesh_bounds(const Light& light) const;
  double power(const Light& light, float scene_radius) const;
  bool by_tree(const V3& n) const {
    return kBuilt.light_trees && !tree_.empty() && (tree_in_media_ || dot(n, n) > 0);
  }
  Drawn only_one() const { return {0, lights_.front().probability}; }
  Drawn draw(std::uint32_t word) const { return alone_ ? only_one() : by_table(word); }
  Drawn draw(std::uint32_t word, const V3& x, const V3& n) const;
  Drawn by_table(std::uint32_t word) const;
  Drawn from_tree(std::uint32_t word, const V3& x, const V3& n) const;
  float probability_at(std::uint32_t light, const V3& x, const V3& n) const;
  std::uint64_t table_words(std::uint32_t light) const;
  LightChoice chosen(const LightNumbers& numbers, const Drawn& drawn) const {
    const Kind kind = lights_[drawn.light].kind;
    return {drawn.light, drawn.probability, has_place(kind), is_point(kind), numbers};
  }
  Point area_point(const Light& light, const LightNumbers& numbers) const;
  Point mesh_point(const Light& light, const LightNumbers& numbers) const;
  Point cylinder_point(const Light& light, V2 u) const;
  // In the next functions p is the probability with which the light was chosen.
  std::optional<LightSample> sample_area(const Light& light, const Point& y, const V3& x, float p) const;
  std::optional<LightSample> sample_sphere(const Light& light, V2 u, const V3& x, float p) const;
  std::optional<LightSample> sample_map(const LightNumbers& numbers) const;
  static LightSample sample_sun(const Light& light, V2 u);
  C3 suns(const V3& direction, float pdf) const;
  C3 spot_radiance(const Light& light, const V3& towards) const;
  C3 projected(const Light& light, const V3& towards) const;
  // The radiance of an area light at `uv` and `face` towards a viewer whose direction has the cosine `cosine`
  // > 0 to the normal.
  C3 area_radiance(const Light& light, V2 uv, const FacePoint* face, float cosine) const {
    return light.uniform ? light.value : varying_radiance(light, uv, face, cosine);
  }
  C3 varying_radiance(const Light& light, V2 uv, const FacePoint* face, float cosine) const;
  static float beam_share(const Light& light, float cosine);
  static double beam_flux(const Light& light);  // per unit radiance and area; pi without a beam

  std::vector<Light> lights_;
  std::vector<std::uint32_t> suns_;  // indices of the suns in lights_
  // Light i is chosen by the words from last_[i - 1] + 1 to last_[i]: its probability is exactly their share.
  std::vector<std::uint32_t> last_;
  bool alone_ = false;  // a single light: no choice needed
  const Geometry* geometry_ = nullptr;
  const TextureTable* textures_ = nullptr;
  C3 environment_{0, 0, 0};
  std::optional<EnvironmentMap> map_;
  float map_probability_ = 0;
  // If there are many lights, those with a position come first in the list and are in the tree. The first
  // words of the table choose these lights; at each point the tree redistributes these words among them,
  // except every kTableShare-th word, which the table keeps.
  LightTree tree_;
  std::uint64_t tree_words_ = 0, table_words_ = 0;
  bool tree_in_media_ = false;
  bool any_with_place_ = false;
  std::uint64_t left_out_ = 0, clamped_ = 0;
};

}  // namespace ls::render
