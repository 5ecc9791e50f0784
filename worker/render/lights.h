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
#include "worker/render/envmap.h"
#include "worker/render/geometry.h"
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

// What is chosen before the shaded point is known.
struct LightChoice {
  std::uint32_t light = 0;
  float probability = 0;
  bool has_place = false;
  V3 pivot;
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
  LightChoice choose(const LightNumbers& numbers) const;
  // Light arriving at x from the chosen light; nothing if none can (behind, outside the cone, zero solid
  // angle).
  std::optional<LightSample> sample(const LightChoice& choice, const V3& x) const;

  // Emission of a surface light towards a viewer (w points from the surface to it).
  C3 emitted(const SurfaceHit& hit, const V3& w) const;
  // Density, per steradian at x and with the choice of the light, of sampling this point of a surface light.
  float pdf(const SurfaceHit& hit, const V3& x, const V3& direction) const;
  V3 pivot(const SurfaceHit& hit) const;
  // Radiance from the surroundings, for a path that leaves the scene in this direction (a unit vector),
  // weighted against sampling it as a light. `pdf`: of the direction, per steradian; infinity where it had no
  // choice, for the full radiance. A constant surrounding is never sampled: it is smooth, and paths that
  // leave find it.
  C3 environment(const V3& direction, float pdf) const {
    if (!map_) return environment_;
    const EnvironmentMap::Light light = map_->at(direction);
    const float as_light = light.pdf * map_probability_;
    return environment_ + (as_light > 0 ? light.radiance * (1 / (1 + as_light / pdf)) : light.radiance);
  }
  bool has_environment() const { return map_ || !is_black(environment_); }
  const EnvironmentMap* map() const { return map_ ? &*map_ : nullptr; }

  std::size_t count() const { return lights_.size(); }
  std::uint64_t left_out() const { return left_out_; }
  std::uint64_t clamped_inputs() const { return clamped_; }  // negative texels made 0

 private:
  enum class Kind { parallelogram, mesh, sphere, disk, directional, point, spot, map };
  static bool has_place(Kind kind) { return kind != Kind::directional && kind != Kind::map; }
  struct Light {
    Kind kind = Kind::point;
    C3 value;               // intensity (point, spot), irradiance (directional)
    TextureIndex radiance;  // area lights; spot: projected texture
    bool textured = false;
    V3 position, axis_u, axis_v,
        normal;          // parallelogram: corner and edges; disk: centre and axes; directional: travel
    V2 uv0, uv_u, uv_v;  // parallelogram: uv at the corner and along the edges
    double area = 0;
    std::uint32_t primitive = 0;  // sphere; mesh: first triangle
    std::vector<double> cdf;      // mesh: of triangle areas
    float sign = 1;               // orientation of the emitting side
    float cos_cutoff = 0, cos_beam = 0, cutoff = 0, inv_transition = 0, tan_cutoff = 0;  // spot
    float probability = 0;
  };
  struct Point {  // on an area light
    V3 p, n;
    V2 uv;
  };

  // Where the primitives of a shape lie in Geometry's lists: each shape's are together.
  struct Range {
    std::uint32_t first = kNone, count = 0;
  };
  struct Primitives {
    std::vector<Range> triangles, spheres, disks;  // by surface
  };

  static Primitives primitives_of(const Geometry& geometry);
  void add_area(const Scene& scene, std::uint32_t shape, const Primitives& primitives, Geometry& geometry);
  Result<void> add_emitter(const Scene& scene, const Emitter& emitter, const ImageLoader& images);
  Result<void> add_map(const Scene& scene, const EnvmapEmitter& emitter, const ImageLoader& images);
  void set_probabilities(float scene_radius);
  double power(const Light& light, float scene_radius) const;
  Point area_point(const Light& light, const LightNumbers& numbers) const;
  Point mesh_point(const Light& light, const LightNumbers& numbers) const;
  std::optional<LightSample> sample_area(const Light& light, const Point& y, const V3& x) const;
  std::optional<LightSample> sample_sphere(const Light& light, V2 u, const V3& x) const;
  std::optional<LightSample> sample_map(const LightNumbers& numbers) const;
  C3 spot_radiance(const Light& light, const V3& towards) const;
  C3 area_radiance(const Light& light, V2 uv) const { return textures_->eval(light.radiance, uv); }

  std::vector<Light> lights_;
  // Light i is chosen by the words above last_[i - 1] up to last_[i]: its probability is exactly their share.
  std::vector<std::uint32_t> last_;
  const Geometry* geometry_ = nullptr;
  const TextureTable* textures_ = nullptr;
  C3 environment_{0, 0, 0};
  std::optional<EnvironmentMap> map_;
  float map_probability_ = 0;
  bool any_with_place_ = false;
  std::uint64_t left_out_ = 0, clamped_ = 0;
};

}  // namespace ls::render
