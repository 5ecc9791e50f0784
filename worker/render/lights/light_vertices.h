// Light vertices: the points at which the light of a directional emitter, the sun, is scattered.
//
// Next-event estimation at the vertices of a camera path finds the sun only where a vertex happens to be lit.
// In a room with a window few vertices are lit, and nearly all light that is scattered twice or more comes
// from them. So paths are traced from the sun, their vertices are kept, and every vertex of a camera path is
// connected to one of them: bidirectional path tracing (Veach 1997, ch. 10) with light subpaths that are kept
// and used again by many paths (Keller 1997, "Instant radiosity"; Davidovic et al. 2014, "Progressive light
// transport simulation on the GPU").
//
// The same path can be sampled by several strategies, which differ in k: the first k vertices are sampled
// from the camera, the rest from the sun. If no vertex is sampled from the sun, the strategy is next-event
// estimation. The strategies are weighted by the balance heuristic. For strategies that connect to a light
// vertex, the density of a vertex is:
//   the first vertex after the sun:
//     kCandidates / (vertices per ray) * (rays per area of the sun's plane) * |cos_sun|,
//   every other vertex, sampled from the sun or from the camera:
//     pdf |cos| / r^2, with the density `pdf` of the direction in which the vertex before it scattered.
// The first factor is the number of rays that have kCandidates vertices on average: a connection chooses one
// of that many vertices (see below). |cos_sun| is the cosine between the vertex's normal and the direction to
// the sun, |cos| that between the normal and the direction to the vertex before, and r the distance to that
// vertex. In a medium the cosines are 1. All densities leave out transmittances and Russian roulette. The
// result is still unbiased: weights need not use the true densities, only the same functions of the path for
// all strategies.
//
// The sum over all light vertices is estimated by resampled importance sampling (Talbot et al. 2005): a block
// of kCandidates vertices is chosen uniformly, and one of them in proportion to a cheap estimate of its
// contribution.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "worker/render/geometry/geometry.h"
#include "worker/render/lights/learned_rectangle.h"
#include "worker/render/math/math.h"

namespace ls::render {

// The distribution of the rays from the sun, over a plane normal to the sun's direction. It is learned from
// the points at which camera paths found the sun. A small share is uniform over the whole scene.
class SunMap {
 public:
  SunMap() = default;
  // `direction` is the light's direction of travel, a unit vector; `radius` that of a sphere about the origin
  // that encloses the scene.
  SunMap(const V3& direction, float radius);

  // Adds a point at which a path found the sun; a weight that is not positive and finite is ignored.
  void learn(const V3& p, float weight) { found_.learn(on_plane(p), weight); }
  void add(const SunMap& other) { found_.add(other.found_); }  // adds what `other`, of the same sun, learned
  void finish();  // call once, after all points: makes the map a density

  bool empty() const { return found_.empty(); }
  const V3& direction() const { return direction_; }
  // The density of the rays through p, per area of the plane; its integral is 1. Positive for every p in the
  // scene.
  float density(const V3& p) const { return density_at(on_plane(p)); }

  struct Ray {
    V3 o;           // origin, outside of the scene
    float density;  // SunMap::density() of this ray
  };
  // Samples a ray by four uniform random words.
  Ray sample(const std::array<std::uint32_t, 4>& bits) const;

 private:
  static constexpr std::size_t kSide = 64;
  V2 on_plane(const V3& p) const { return {dot(p, u_), dot(p, v_)}; }
  float density_at(V2 at) const { return everywhere_ + found_.density(at); }

  V3 direction_{0, 0, 1}, u_{1, 0, 0}, v_{0, 1, 0};
  float radius_ = 1;
  LearnedRectangle found_{kSide};
  float everywhere_ = 0;  // density of the rays that are uniform over the scene, per area of the plane
};

// A subpath's share in the denominator of the balance heuristic, for subpaths from the camera and from the
// sun. It is a sum over all strategies that find the same path with a shorter subpath from this end; the term
// of a strategy is its density divided by the density of the strategy with this subpath. It is computed
// vertex by vertex, as by Georgiev 2012, "Implementing vertex connection and merging", eqs. 31 to 36.
struct SubpathDensities {
  float last = 0;  // 1 / (density with which the last vertex is sampled from this end)
  // The part of the sum that belongs to the vertices before the last one, without the factor `back` of sum().
  float before = 0;

  // Returns the subpath's share without one factor: the density with which the last vertex is sampled from
  // the other end. `back` is the density, per steradian, with which a path that comes from the other end and
  // scatters at the last vertex samples the direction to the vertex before it.
  float sum(float back) const { return last * (1 + before * back); }
  bool needs_back() const { return before > 0; }

  // Returns the densities of a subpath that is one segment longer. `f` is the new segment, `pdf` the density
  // with which its direction was sampled, and `sum` the sum() of the shorter subpath. ng and ng_before are
  // the geometric normals at the end and at the start of the segment, 0 in media.
  static SubpathDensities extended(const V3& f, float pdf, float sum, const V3& ng, const V3& ng_before) {
    const float r2 = dot(f, f), r = std::sqrt(r2);
    const auto cosine = [&](const V3& n) { return is_black(n) ? 1.f : std::abs(dot(n, f)) / r; };
    return {r2 / (pdf * cosine(ng)), sum * cosine(ng_before) / r2};
  }
};

struct LightVertex {
  SurfaceHit hit;  // valid if the vertex is on a surface
  V3 p{0, 0, 0};
  std::uint32_t medium = kNone;  // index of the medium in which the vertex is; kNone: it is on a surface
  // The light that arrives at the vertex, divided by the expected number of vertices per area of the surface
  // or per volume. In a medium it includes the albedo.
  C3 light{0, 0, 0};
  V3 to_light{0, 0, 1};  // the direction from which the light arrives
  int scatterings = 0;   // scatterings of the light so far, including the one at this vertex
  SubpathDensities densities;
};

// A vertex of a camera path that is to be connected to a light vertex.
struct Receiver {
  V3 p{0, 0, 0};
  V3 n{0, 0, 0};            // on surfaces: the shading normal, on the side from which the path came
  bool both_sides = false;  // on surfaces: true if light may also arrive at the other side
  V3 d{0, 0, 0};            // in media: the direction of travel before the scattering
  float g = 0;              // in media: the asymmetry parameter of the phase function
  bool in_medium = false;
};

class LightVertices {
 public:
  static constexpr std::size_t kCandidates = 32;

  // How a light vertex looks from other points; from this choose() estimates the vertex's contribution. Up to
  // a common factor the radiance that leaves the vertex, times its cosine to the normal (1 in media), is
  //   even * cosine + lobe * 4 pi * (the Henyey-Greenstein phase function with parameter g),
  // where the phase function takes the angle between the outgoing direction and -axis. The lobe of a glossy
  // surface has no cosine factor, like the lobe of a microfacet distribution.
  struct Look {
    V3 n{0, 0, 0};  // surfaces: the geometric normal, on the side that is lit
    // Surfaces: true if light may also leave on the other side, as through glass or where the shading normal
    // is tilted.
    bool both_sides = false;
    float even = 0, lobe = 0;  // factors of the two terms above; their sum is positive
    V3 axis{0, 0, 1};
    float g = 0;
    // 1 / densities.sum(1 / (4 pi)). The argument assumes that paths from the camera scatter uniformly in all
    // directions at this vertex. The larger it is, the more weight connections to this vertex have among all
    // strategies that find its light.
    float density = 0;
  };
  void add(const LightVertex& vertex, const Look& look);
  void finish();  // call once, after the last add()

  struct Choice {
    const LightVertex* vertex = nullptr;  // null: all candidates have the estimate 0
    float weight = 0;                     // 1 / (expected number of times that this vertex is chosen)
  };
  // Loads into the processor's caches the data that choose() needs if it is called with this `block`.
  void prefetch(std::uint32_t block) const;
  // Chooses a light vertex for x. `block` is 32 uniform random bits, which choose a block of vertices; u is
  // uniform in [0, 1) and chooses one of them.
  Choice choose(const Receiver& x, std::uint32_t block, float u) const;

  std::size_t count() const { return vertices_.size(); }

 private:
  using Lane = std::array<float, kCandidates>;
  struct Block {
    Lane x{}, y{}, z{}, nx{}, ny{}, nz{}, ax{}, ay{}, az{}, other_side{}, round{}, g{}, even{}, lobe{},
        density{};
  };
  std::size_t index_of(std::uint32_t block) const { return (std::uint64_t{block} * blocks_.size()) >> 32; }
  static void towards(const Block& block, const Receiver& x, Lane& target);

  std::vector<LightVertex> vertices_;
  std::vector<Block> blocks_;
};

// Caches the sets of light vertices of a world. The even samples of a pixel form one half and the odd ones
// the other; the error is estimated by comparing the halves. The halves use different sets, so that they are
// independent. In each half kEpoch / 2 successive samples use the same set, and later samples the next one,
// so that the image also averages over sets: all pixels have the error of a set in common, and it decides
// the error of large areas (docs/decisions/0031-connections-to-light-vertices.md).
class LightVertexCache {
 public:
  static constexpr std::uint64_t kEpoch = 16;
  using Build = std::function<LightVertices(std::uint64_t set)>;

  static std::uint64_t set_of(std::uint64_t sample) { return 2 * (sample / kEpoch) + (sample & 1); }
  // Returns the set with this number, and builds it if it is not cached. Thread-safe; a thread waits only for
  // the set that it needs.
  std::shared_ptr<const LightVertices> get(std::uint64_t set, const Build& build);

 private:
  static constexpr std::size_t kKept = 16;
  struct Slot {
    std::once_flag once;
    std::shared_ptr<const LightVertices> vertices;
  };
  std::mutex mutex_;
  // The cached sets by number, most recently used first.
  std::list<std::pair<std::uint64_t, std::shared_ptr<Slot>>> kept_;
};

}  // namespace ls::render
