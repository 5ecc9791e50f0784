// The lights of a world, how they are chosen and sampled, and with which density.
//
// A light with a place has a pivot: the point that equi-angular sampling of a segment turns about. For an
// area light it is the sampled point, for a sphere its centre (the point itself is sampled from where the
// segment vertex comes to lie).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/built.h"
#include "worker/render/envmap.h"
#include "worker/render/geometry.h"
#include "worker/render/lights_tree.h"
#include "worker/render/math.h"
#include "worker/render/texture/texture.h"

namespace ls::render {

struct LightSample {
  V3 direction;        // unit, from the shaded point towards the light
  float distance = 0;  // to the light along it; infinity for distant lights
  V3 target{0, 0, 0};  // the light's point, moved off its surface: where a shadow ray must get to (not for
                       // distant lights)
  C3 radiance;         // arriving without obstruction; for delta lights irradiance on a plane facing it
  float pdf =
      0;  // per steradian, choice of the light included; for delta lights the probability of the choice alone
  bool delta = false;
};

// Random words a light and a point on it are made from: all 32 bits of each, because which of many lights or
// triangles they mean is a matter of the last ones.
struct LightNumbers {
  std::uint32_t light = 0, x = 0, y = 0;
};

// Which light, and for area lights which point of it.
struct LightChoice {
  std::uint32_t light = 0;
  float probability = 0;
  bool has_place = false, is_point = false;  // is_point: a place without an extent
  LightNumbers numbers;
};

class Lights {
 public:
  // Gives the surfaces of `geometry` their light numbers. Lights without power or area are left out, counted.
  // `images` loads environment maps: scenes without one need none.
  static Result<Lights> build(const Scene& scene, Geometry& geometry, const TextureTable& textures,
                              const ImageLoader& images = {});

  bool can_sample() const { return !lights_.empty(); }  // any light that next-event estimation can reach
  bool any_with_place() const { return any_with_place_; }
  std::vector<V3> points() const;  // where the lights are that have a place without an extent
  // Before the shaded point is known: half by power, half each as often.
  LightChoice choose(const LightNumbers& numbers) const { return chosen(numbers, draw(numbers.light)); }
  // For the point x of a surface of normal n, or of a medium (n = 0): of many lights, by a tree.
  LightChoice choose(const LightNumbers& numbers, const V3& x, const V3& n) const {
    return chosen(numbers, alone_ ? only_one() : draw(numbers.light, x, n));
  }
  // Only of a light with a place.
  V3 pivot(const LightChoice& choice) const;
  // Light arriving at x from the chosen light; nothing if none can (behind, outside the cone, zero solid
  // angle).
  std::optional<LightSample> sample(const LightChoice& choice, const V3& x) const;

  // Emission of a surface light towards a viewer (w points from the surface to it).
  C3 emitted(const SurfaceHit& hit, const V3& w) const;
  // Density, per steradian at x and with the choice of the light, of sampling this point of a surface light
  // from choose(numbers, x, n).
  float pdf(const SurfaceHit& hit, const V3& x, const V3& direction, const V3& n = V3(0)) const;
  V3 pivot(const SurfaceHit& hit) const;
  // Radiance from the surroundings, for a path that leaves the scene in this direction (a unit vector),
  // weighted against sampling it as a light. `pdf`: of the direction, per steradian; infinity where it had no
  // choice, for the full radiance. A constant surrounding is never sampled: it is smooth, and paths that
  // leave find it.
  C3 environment(const V3& direction, float pdf) const {
    const C3 beside = suns_.empty() ? environment_ : environment_ + suns(direction, pdf);
    if (!kBuilt.environment_maps || !map_) return beside;
    const EnvironmentMap::Light light = map_->at(direction);
    const float as_light = light.pdf * map_probability_;
    return beside + (as_light > 0 ? light.radiance * (1 / (1 + as_light / pdf)) : light.radiance);
  }
  bool has_environment() const { return map_ || !suns_.empty() || !is_black(environment_); }
  const EnvironmentMap* map() const { return map_ ? &*map_ : nullptr; }

  // Points in media choose by the tree, too, if there is one: for those who light them from nowhere else.
  void use_tree_in_media() { tree_in_media_ = true; }
  bool has_tree() const { return !tree_.empty(); }
  std::uint64_t tree_bytes() const { return tree_.bytes(); }
  std::uint64_t table_bytes() const;

  std::size_t count() const { return lights_.size(); }
  std::uint64_t left_out() const { return left_out_; }
  std::uint64_t clamped_inputs() const { return clamped_; }  // negative texels made 0

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
    C3 value;  // intensity (point, spot), irradiance (directional; projector: of a texture of 1 on
               // the plane at distance 1), radiance (sun; area lights that are uniform)
    TextureIndex radiance;  // area lights; spot, projector: projected texture
    bool textured = false;
    bool beam = false;     // area lights: radiance depends on the angle
    bool uniform = false;  // area lights: neither
    V3 position, axis_u, axis_v,
        normal;          // parallelogram: corner and edges; disk: centre and axes; directional: travel
    V2 uv0, uv_u, uv_v;  // parallelogram: uv at the corner and along the edges
    double area = 0;
    std::uint32_t primitive = 0;  // sphere, cylinder; mesh: first triangle
    std::vector<double> cdf;      // mesh: of triangle areas
    float sign = 1;               // orientation of the emitting side
    float reach = 1;              // area lights: the largest coordinate of a point on it
    float cos_cutoff = 0, cos_beam = 0, cutoff = 0, inv_transition = 0, tan_cutoff = 0;  // spot
    float falloff = 1;                // beam: with cos_cutoff, cos_beam and, by cosines, inv_transition
    float tan_x = 0, tan_y = 0;       // projector: of half its fields of view
    float cone = 0, sun_density = 0;  // sun: 1 - cos of its angular radius; 1 / solid angle
    float probability = 0;
  };
  struct Point {  // on an area light
    V3 p, n;
    V2 uv{0, 0};  // only where that matters: of textured lights
    FacePoint face;
  };

  // Where the primitives of a shape lie in Geometry's lists: each shape's are together.
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
  // p: the probability that the light was chosen with.
  std::optional<LightSample> sample_area(const Light& light, const Point& y, const V3& x, float p) const;
  std::optional<LightSample> sample_sphere(const Light& light, V2 u, const V3& x, float p) const;
  std::optional<LightSample> sample_map(const LightNumbers& numbers) const;
  static LightSample sample_sun(const Light& light, V2 u);
  C3 suns(const V3& direction, float pdf) const;
  C3 spot_radiance(const Light& light, const V3& towards) const;
  C3 projected(const Light& light, const V3& towards) const;
  // Towards a viewer at an angle of this cosine > 0 from the normal.
  C3 area_radiance(const Light& light, V2 uv, const FacePoint* face, float cosine) const {
    return light.uniform ? light.value : varying_radiance(light, uv, face, cosine);
  }
  C3 varying_radiance(const Light& light, V2 uv, const FacePoint* face, float cosine) const;
  static float beam_share(const Light& light, float cosine);
  static double beam_flux(const Light& light);  // per radiance and area; pi without a beam

  std::vector<Light> lights_;
  std::vector<std::uint32_t> suns_;  // those of that kind
  // Light i is chosen by the words above last_[i - 1] up to last_[i]: its probability is exactly their share.
  std::vector<std::uint32_t> last_;
  bool alone_ = false;  // a single light: there is nothing to choose
  const Geometry* geometry_ = nullptr;
  const TextureTable* textures_ = nullptr;
  C3 environment_{0, 0, 0};
  std::optional<EnvironmentMap> map_;
  float map_probability_ = 0;
  // Of many lights: those with a place come first in the list, and the tree is theirs. Their words of the
  // table, the first ones, are shared out anew at each point, but for every kTableShare-th.
  LightTree tree_;
  std::uint64_t tree_words_ = 0, table_words_ = 0;
  bool tree_in_media_ = false;
  bool any_with_place_ = false;
  std::uint64_t left_out_ = 0, clamped_ = 0;
};

}  // namespace ls::render
