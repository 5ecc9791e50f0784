// The results of paths: the radiance and its components, data for AOVs, what learning paths record (paths
// that are traced before the first sample: light_paths.h), and the tails that the paths of several pixels
// share.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/image/film/health.h"
#include "worker/render/base/light_group.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/geometry/geometry.h"
#include "worker/render/math/math.h"
#include "worker/render/media/medium.h"
#include "worker/render/media/medium_stack.h"
#include "worker/render/world/world.h"

namespace ls::render {

struct SampleOutcome {
  C3 radiance{0, 0, 0};
  // The first reason to reject the sample regardless of its radiance; none if there is no such reason.
  HealthCause cut_off = HealthCause::none;
  std::uint64_t majorant_violations = 0;

  void reject(HealthCause cause) {
    if (cut_off == HealthCause::none) cut_off = cause;
  }
};
struct FirstSurface {
  SurfaceHit hit;
  // 1 / (1 - probability of passing straight through): the weight that compensates for the random decision to
  // be scattered.
  float not_passed = 1;
};

// Albedo and normal that guide a denoiser: one sample of each of the AOVs denoising_albedo and
// denoising_normal.
struct DenoisingGuide {
  C3 albedo{0, 0, 0};
  V3d normal{0, 0, 0};
};

// The medium between two boundaries on a ray of a probe (DeepProbe).
struct DeepSegment {
  float begin = 0, end = 0;  // depths, counted as that of the AOV depth; `end` may be infinite
  V3 start{0, 0, 0}, d{0, 0, 1};
  float surfaces = 1;  // transmittance of the surfaces in front of it
  std::vector<const Medium*> media;
};
// Describes what a camera ray passes and meets. A few such rays determine the slices of a deep image.
struct DeepProbe {
  std::vector<DeepSegment> segments;
  float surface = kInfinity;  // depth of the surface at which it ends; infinite: it leaves the scene
  std::vector<float> lamps;   // depths of the surfaces that it passes and that shine
  float reaches = 1;          // transmittance of the surfaces that it passed
};
// Returns the depth, inside the nearest of the ranges, at which a surface at this depth counts. Between the
// probes that found the ranges a pixel's surfaces can be at any depth, and none may become part of the fog.
inline float depth_in(std::span<const SurfaceRange> ranges, float depth) {
  float nearest = depth, least = kInfinity;
  for (const SurfaceRange& range : ranges) {
    if (depth >= range.begin && depth < range.end) return depth;
    const float away = depth < range.begin ? range.begin - depth : depth - range.end;
    if (away < least) {
      least = away;
      nearest = range.begin + (range.end - range.begin) / 2;  // its end is of the next slice
    }
  }
  return nearest;
}
// The transmittances that PathTracer::opacity() finds at the edges of a deep image's slices.
struct DeepTransmittance {
  std::span<const float> edges;  // depths between slices, in ascending order
  std::span<const SurfaceRange> surfaces;
  // The transmittance up to each of them, and behind everything but the environment: mean of the channels
  std::span<double> through;
};

// One sample of the AOVs of opacity: 1 - transmittance of all media and surfaces on the camera ray (`all`),
// and of the media up to the first surface that scatters (`media`).
struct Opacity {
  C3 all{0, 0, 0}, media{0, 0, 0};
  // For the AOV shadow_catcher. If the ray ends on a shadow catcher, these are the catcher's direct light,
  // the share of the light behind the scene that reaches the camera, and the direct light without other
  // shapes and media. The first and the last are multiplied by the share.
  C3 shadow{0, 0, 0};
};

// The components into which the radiance of a sample is split. The light AOVs (auxiliary images) are sums of
// components. One split is by the scatterings on the light's path (LightPart), the other by the light groups.
//
// A LightPart is defined by the first scattering of the path, counted from the camera, and by whether more
// scatterings follow.
enum class LightPart : std::uint8_t {
  unscattered,    // directly visible: lights, environment, medium emission
  surface_once,   // one scattering, at a surface
  surface_again,  // several scatterings, the first at a surface
  volume_once,    // one scattering, in a medium
  volume_again,   // several scatterings, the first in a medium
};
inline constexpr std::size_t kLightParts = 5;

constexpr bool in_volume(LightPart part) {
  return part == LightPart::volume_once || part == LightPart::volume_again;
}

// The light of a sample by the depth at which it was first scattered or emitted, seen from the camera, for a
// deep image. The path tracer notes the depth with see() before it adds light, until the first scattering:
// from then on all light counts at that depth.
struct LightByDepth {
  struct Event {
    float depth;   // distance from the camera, as that of the AOV depth; infinite for the environment
    bool surface;  // true if a surface scattered or emitted the light
    C3 light;
  };
  bool wanted = false;
  // The depths between the pixel's slices. The emission of a medium, which is one number for a whole segment,
  // is divided there. Empty: no medium emits light.
  std::span<const float> edges;
  std::vector<Event> events;

  void clear() { events.clear(); }
  void begin(const V3& camera, float near_distance) {
    camera_ = camera;
    near_ = near_distance;
  }
  float depth(const V3& p, const V3& d) const { return near_ + dot(p - camera_, d); }
  void see(float depth, bool surface = false) {
    at_ = depth;
    surface_ = surface;
  }
  void add(const C3& light) {
    if (!events.empty() && events.back().depth == at_ && events.back().surface == surface_)
      events.back().light += light;
    else
      events.push_back({at_, surface_, light});
  }

 private:
  V3 camera_{0, 0, 0};
  float near_ = 0, at_ = 0;
  bool surface_ = false;
};

struct LightSplit {
  std::array<C3, kLightParts> parts;
  LightByDepth by_depth;
  // The first `groups` elements of `by_group` have the light of each group; those of `volume_by_group` the
  // part of it whose first scattering was in a medium (in_volume()). The other elements are not set.
  std::size_t groups = 0;
  std::array<C3, kMostLightGroups> by_group, volume_by_group;

  // Makes all components black. C3's default constructor leaves values uninitialised.
  void clear(std::size_t light_groups) {
    groups = light_groups;
    parts.fill(C3(0));
    by_depth.clear();
    std::fill_n(by_group.begin(), groups, C3(0));
    std::fill_n(volume_by_group.begin(), groups, C3(0));
  }
  void add_to_group(LightGroup group, LightPart part, const C3& light) {
    if (group >= groups) return;
    by_group[group] += light;
    if (in_volume(part)) volume_by_group[group] += light;
  }
};

constexpr LightPart part_of(int scatterings, bool first_in_medium) {
  if (scatterings == 0) return LightPart::unscattered;
  if (first_in_medium) return scatterings == 1 ? LightPart::volume_once : LightPart::volume_again;
  return scatterings == 1 ? LightPart::surface_once : LightPart::surface_again;
}

// Data, in addition to the world, for paths with Features::connected: paths whose vertices are connected to
// light vertices (points that the sun lights: light_vertices.h), and paths that learn.
struct Connections {
  const LightVertices* vertices = nullptr;  // null if paths are not connected
  // The records of learning paths about the light that connections, portals or local lights could find.
  // `learner` is null for other paths.
  struct Learner {
    SunMap map;
    double light = 0;     // sum of the sun's light that was found
    double vertices = 0;  // number of vertices at which the sun could be found
    double lit = 0;       // estimated number of those vertices at which the sun was found
    // True if a ray towards the sun met other media than a ray from the sun would. The scene then declares
    // different media on the two sides of a boundary, or the medium outside is not a vacuum.
    bool media_differ = false;
    bool keeps_sky = false;  // true if the light of the sky that vertices found is kept in `sky`
    std::vector<Portals::Found> sky;
    double scatterings = 0;     // number of all vertices of the paths
    double left = 0;            // number of vertices that paths left towards the sky
    bool keeps_lights = false;  // true if each vertex samples all lights and keeps their light in `lights`
    LightVisits lights;

    void found_sky(const V3& p, const V3& d, float found) {
      if (keeps_sky && found > 0 && std::isfinite(found)) sky.push_back({p, d, found});
    }
  };
  Learner* learner = nullptr;
};

// The pixels of a group share the parts of their paths from the second vertices on, their tails
// (path_reuse.h). This is the largest number of pixels in a group.
inline constexpr std::size_t kMostSharing = 64;

struct PathVertex {
  V3 p{0, 0, 0};
  const Medium* medium = nullptr;  // null if the vertex is on a surface, at `hit`
  SurfaceHit hit;
};

// The first vertex of a path, which is connected to the second vertices of other paths.
struct FirstVertex {
  bool usable = false;  // false if there is no first vertex or it scatters by delta lobes alone
  PathVertex at;
  V3 d{0, 0, 0};     // the direction of travel before the vertex
  C3 beta{0, 0, 0};  // the weight of the path up to the vertex
  // The path's density with each channel as the hero (medium.h), divided by the mean of the three densities
  C3 density{1, 1, 1};
  OneMedium around;  // the medium in front of the vertex
  int passed = 0;    // number of surfaces passed straight through between camera and vertex
  // A cache for a diffuse surface: the BSDF for a direction along the normal, on the normal's side [0] or on
  // the other [1]; nullopt if it was not evaluated yet.
  std::array<std::optional<BsdfEval>, 2> by_side;
};

// The second vertex of a path, and the light that arrives there.
struct SharedTail {
  // False if there is no second vertex, or if the direction to it was sampled by a delta lobe
  bool usable = false;
  PathVertex at;
  int passed = 0;  // number of surfaces passed straight through between camera and vertex
  // For the way from the path's own first vertex to the second: `depth` is the optical depth of the media, by
  // channel, `transmission` the null transmission of the surfaces, and `passing` the probability of passing
  // straight through all of these surfaces.
  C3 depth{0, 0, 0}, transmission{1, 1, 1};
  float passing = 1;

  // The light that next-event estimation found at the second vertex; light_pdf is 0 if it found none.
  V3 to_light{0, 0, 0};
  float light_pdf = 0;
  bool light_is_delta = false;
  C3 light{0, 0, 0};

  // Light from `onward`, the direction in which the path goes on: `emitted` by the light source that the ray
  // hits, if any, and `scattered` at later vertices. Next-event estimation finds that light source with the
  // density hit_pdf.
  bool goes_on = false;
  V3 onward{0, 0, 0};
  C3 emitted{0, 0, 0}, scattered{0, 0, 0};
  float hit_pdf = 0;

  // With Features::split: the groups of `light` and of `emitted`.
  LightGroup light_group = kNoLightGroup, emitted_group = kNoLightGroup;

  bool brings_light() const { return light_pdf > 0 || !is_black(emitted) || !is_black(scattered); }
};

// SharedTail::scattered by light groups, for paths with Features::split.
struct TailByGroup {
  std::size_t groups = 0;  // number of elements of `scattered` that are set
  std::array<C3, kMostLightGroups> scattered;

  void clear(std::size_t light_groups) {
    groups = light_groups;
    std::fill_n(scattered.begin(), groups, C3(0));
  }
  void add(LightGroup group, const C3& light) {
    if (group < groups) scattered[group] += light;
  }
};

// The state of a path that records its first vertex and its tail.
struct SharingPath {
  enum class Part : std::uint8_t {
    alone,   // before the first vertex, and from there on if the path has no tail to share
    second,  // on the way from the first vertex to the second
    tail,    // from the second vertex on
  };
  Part part = Part::alone;
  FirstVertex first;
  SharedTail tail;
  // The path's weight up to its first vertex, scattering included, once the path is on the way to the second.
  // The weight is then no longer part of the path tracer's beta_, and multiplies light that counts for this
  // pixel only.
  C3 scale{1, 1, 1};
  // The part of the throughput that is no longer in beta_. Russian roulette multiplies beta_ by it (size()).
  float survival = 1;
  // look_at() sets `flight` and `crossed` for the shadow ray that it traces:
  C3 flight{1, 1, 1};  // the transmittance of its media times the probability of passing its surfaces
  int crossed = 0;     // number of surfaces that it passed
};

}  // namespace ls::render
