#include "worker/render/integrator/light_paths.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "worker/render/base/in_order.h"
#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"
#include "worker/render/math/processor.h"
#include "worker/render/world/aim.h"
#include "worker/render/world/pilot.h"
#include "worker/render/world/roulette.h"
#include "worker/render/world/world_build.h"

namespace ls::render {
namespace {

// The largest numbers of camera paths from which the sun map (the distribution of rays from the sun: SunMap)
// and the portals (openings to the sky: lights/portals.h) are learned. The number is also at most
// kLearningPathsPerPixel for each pixel of the full frame.
constexpr std::uint64_t kLearningPaths = 1 << 16;
constexpr std::uint64_t kPortalPaths = 1 << 14;
constexpr std::uint64_t kLearningPathsPerPixel = 16;
// Paths are traced in batches of this many, on several threads.
constexpr std::uint64_t kLearningBatch = 1 << 10;
// After this many batches learning stops if they show that the technique (connections or portals) does not
// pay, that is, that it costs more than it gains (light_paths.h).
constexpr std::uint64_t kFirstBatches = 4;
// Portals are tried if, of all directions that BSDFs and phase functions sample, at most the share
// kLeftThatPays leads to the sky. Portals pay if the noise of some pixels is more than kPortalGainThatPays
// times as high without portals as with them. If next-event estimation had no light to sample before, portals
// add shadow rays; then the factor is kShadowGainThatPays.
constexpr double kLeftThatPays = .125;
constexpr double kPortalGainThatPays = 1.1;
constexpr double kShadowGainThatPays = 2;
// Portals are learned from paths of at most this many segments.
constexpr int kLongestPortalPath = 4;
// The choice of lights by place is learned from camera paths of at most kLongestLocalLightPath segments,
// which sample every light at each vertex. There are at most kLocalLightPaths such paths, and fewer if there
// are many lights (kLocalLightLooks). The choice is tried if, over the vertices of the first paths, the
// estimates of direct light have a mean square of more than kSpreadThatPays times the square of their mean.
// It pays if the noise of the direct light of some pixels is more than kLocalGainThatPays times as high
// without it. This limit is high for two reasons: samples take up to 1.5 times as long, because a light that
// reaches the vertex costs more time than one that does not; and the few pixels of a pilot (a rendering that
// measures the noise) hardly show the edges of small patches of light.
constexpr std::uint64_t kLocalLightPaths = 1 << 14;
constexpr std::uint64_t kLocalLightLooks = 1 << 17;  // limit for the number of lights times that of paths
// The first 1 / kLocalLightTrial of the paths decide whether the choice by place is tried
constexpr std::uint64_t kLocalLightTrial = 4;
constexpr int kLongestLocalLightPath = 6;
constexpr double kSpreadThatPays = 1.2;
constexpr double kLocalGainThatPays = 3;
// Looking for emissive grids pays if the noise of some pixels is more than this many times as high without
// it, since it traces a ray and walks along it at each vertex.
constexpr double kEmissiveGainThatPays = 2;
// A batch ends after this many vertices, since paths may be long.
constexpr double kLearningVertices = 1 << 15;
// A batch also ends after this many rays, counting also the boundaries that shadow rays pass: a path may pass
// any number of boundaries between two vertices. The limit is 1,024 for each path of a batch, which paths
// exceed in few scenes.
constexpr std::uint64_t kLearningRaysOfBatch = 1 << 20;
// Number of rays from the sun for one set of light vertices, the points that these rays light and to which
// vertices of camera paths are connected
constexpr std::uint64_t kSunRays = 1 << 14;
// Number of rays from which the mean number of light vertices per ray of the sun is estimated.
constexpr std::uint64_t kLearningRays = 1 << 12;
// From this many scatterings on, connected paths are subject to Russian roulette: light that deep paths find
// is also found by connections of their first vertices.
constexpr int kConnectedRoulette = 2;
// Connections pay if next-event estimation finds the sun at less than the share kLitThatPays of the vertices,
// and if the light that it finds there is more than the share kLightThatPays of the image's light.
constexpr double kLitThatPays = .15;
constexpr double kLightThatPays = .1;
// Lower bound [1/sr] for the BSDF that look_of() assumes at a light vertex on a surface. A glossy surface may
// reflect little in the four directions for which look_of() evaluates the BSDF, but much in others.
constexpr float kLeastReflected = .01f;
// A shading normal counts as tilted if its cosine to the geometric normal is smaller than this.
constexpr float kUntilted = .999999f;
// Connections that would add less than this share of the image's mean radiance are subject to Russian
// roulette.
constexpr float kFaintConnection = .5f;

constexpr std::uint64_t kLearningSeed = 0x5eed0f1ea2;
constexpr std::uint64_t kSunRaySeed = 0x5eed0f5a1;

// The paths of one learning pass and the data that they record. All passes record where paths find the sun
// (SunMap).
struct Lesson {
  // `sky` is true if paths record the light of the sky, `lights` if they record that of each light source.
  bool sky = false, lights = false;
  std::uint64_t first_path = 0, batch = kLearningBatch;
};

struct Learned {
  Connections::Learner learner;
  double radiance = 0;  // sum of the radiances of all paths
  std::uint64_t paths = 0;

  explicit Learned(const World& w, const Lesson& lesson = {}) {
    learner.map = SunMap(w.sun.direction, w.geometry.radius);
    learner.keeps_sky = lesson.sky;
    learner.keeps_lights = lesson.lights;
  }
  void add(const Learned& batch) {
    learner.map.add(batch.learner.map);
    learner.light += batch.learner.light;
    learner.vertices += batch.learner.vertices;
    learner.lit += batch.learner.lit;
    learner.media_differ = learner.media_differ || batch.learner.media_differ;
    learner.sky.insert(learner.sky.end(), batch.learner.sky.begin(), batch.learner.sky.end());
    learner.scatterings += batch.learner.scatterings;
    learner.left += batch.learner.left;
    learner.lights.add(batch.learner.lights);
    radiance += batch.radiance;
    paths += batch.paths;
  }
  bool pays() const {
    return learner.lit < kLitThatPays * learner.vertices && learner.light > kLightThatPays * radiance;
  }
};

template <Features F, template <Features> class Light>
Learned learn_batch(const World& w, const Lesson& lesson, std::uint64_t first, std::uint64_t end) {
  const FlushDenormals mode;
  Learned learned(w, lesson);
  std::uint64_t rays = 0;
  const auto goes_on = [&] {
    return learned.learner.vertices <= kLearningVertices && rays <= kLearningRaysOfBatch;
  };
  for (std::uint64_t i = first; i < end && goes_on(); ++i) {
    const SampleStream stream(kLearningSeed, 0, 0, 2 * i);
    const Group at = stream.group(0, Purpose::guide), lens = stream.group(0, Purpose::camera);
    const CameraRay ray = camera_ray_through(w, stream, at.u(0) * w.frame.width, at.u(1) * w.frame.height,
                                             {lens.u(2), lens.u(3)});
    PathTracer<F, Light> path(w, stream, nullptr, {.learner = &learned.learner});
    const SampleOutcome out = path.trace(ray);
    rays += path.rays();
    ++learned.paths;
    const double radiance = double{mean_component(out.radiance)};
    if (out.cut_off == HealthCause::none && std::isfinite(radiance)) learned.radiance += radiance;
  }
  return learned;
}

// Traces the camera paths with the numbers from lesson.first_path up to `paths` or up to the limit of
// kLearningPathsPerPixel, whichever is less. After the first kFirstBatches batches, go_on(learner) decides
// whether to trace the rest.
template <Features F, template <Features> class Light, class GoOn>
Learned learn_with(const World& w, std::uint64_t paths, int threads, const GoOn& go_on,
                   const Lesson& lesson) {
  const auto pixels = static_cast<std::uint64_t>(w.frame.width) * static_cast<std::uint64_t>(w.frame.height);
  const std::uint64_t most = std::min(paths, kLearningPathsPerPixel * pixels);
  const std::uint64_t first = std::min(lesson.first_path, most);
  const std::uint64_t batches = (most - first + lesson.batch - 1) / lesson.batch;
  Learned learned(w);
  in_order(
      threads, batches,
      [&](std::size_t i) {
        const std::uint64_t begin = first + i * lesson.batch;
        return learn_batch<F, Light>(w, lesson, begin, std::min(begin + lesson.batch, most));
      },
      [&, taken = std::uint64_t{0}](const Learned& batch) mutable {
        learned.add(batch);
        return ++taken != kFirstBatches || go_on(learned.learner);
      });
  return learned;
}

template <Features F>
LightVertices trace_with(const World& w, std::uint64_t seed, std::uint32_t set, std::uint64_t rays) {
  LightVertices all;
  for (std::uint64_t i = 0; i < rays; ++i) {
    const SampleStream stream(combine(seed, kSunRaySeed), set, 0, 2 * i);
    const SunMap::Ray ray = w.sun_map.sample(stream.group(0, Purpose::connect).bits);
    PathTracer<F>(w, stream).follow_light(ray, [&](LightVertex y) {
      y.light *= 1.f / static_cast<float>(rays);
      const LightVertices::Look look = look_of(w, y);
      const auto usable = [](float x) { return x > 0 && std::isfinite(x); };
      if (usable(look.even + look.lobe) && usable(look.density)) all.add(y, look);
    });
  }
  all.finish();
  return all;
}

constexpr Features kSurfaces{.passing = true, .connected = true};
constexpr Features kMedia{.media = true, .grids = true, .passing = true, .connected = true};
constexpr Features kAimed = kMedia.with(&Features::aimed);
constexpr Features kAnyPhase = kAimed.with(&Features::phases);
constexpr Features kWithHeight = kAnyPhase.with(&Features::height);

template <class GoOn>
Learned learn(const World& w, std::uint64_t paths, int threads, const GoOn& go_on,
              const Lesson& lesson = {}) {
  if (w.need.height) return learn_with<kWithHeight, CameraSegmentNee>(w, paths, threads, go_on, lesson);
  if (w.need.phases) return learn_with<kAnyPhase, CameraSegmentNee>(w, paths, threads, go_on, lesson);
  if (w.need.aimed) return learn_with<kAimed, CameraSegmentNee>(w, paths, threads, go_on, lesson);
  return w.need.media ? learn_with<kMedia, VertexNee>(w, paths, threads, go_on, lesson)
                      : learn_with<kSurfaces, VertexNee>(w, paths, threads, go_on, lesson);
}

// True if a path tracer that is compiled for learning has all features that the world needs.
bool can_learn(const World& w) {
  Features need = w.need;
  need.split = false;
  need.connected = true;
  return kWithHeight.covers(need);
}

// Traces a set of light vertices. It uses a path tracer with the features of the camera paths, because the
// MIS weights depend on how directions are sampled.
LightVertices trace(const World& w, std::uint64_t seed, std::uint32_t set, std::uint64_t rays) {
  if (w.need.height) return trace_with<kWithHeight>(w, seed, set, rays);
  if (w.need.phases) return trace_with<kAnyPhase>(w, seed, set, rays);
  if (w.need.aimed) return trace_with<kAimed>(w, seed, set, rays);
  return w.need.media ? trace_with<kMedia>(w, seed, set, rays) : trace_with<kSurfaces>(w, seed, set, rays);
}

}  // namespace

LightVertices::Look look_of(const World& w, const LightVertex& y) {
  const float light = mean_component(y.light) / mean_component(w.sun.irradiance);
  LightVertices::Look look;
  look.density = 1 / y.densities.sum(kInvFourPi);
  if (y.medium == kNone) {
    const SurfaceInfo& surface = w.geometry.surfaces[y.hit.surface];
    look.n = dot(y.to_light, y.hit.ng) > 0 ? y.hit.ng : -y.hit.ng;
    look.both_sides =
        surface.crossed || std::abs(dot(y.hit.shading.n, y.hit.ng)) < kUntilted || surface.wants_slopes;
    const V3 to_light = y.hit.shading.to_local(y.to_light);
    const auto eval = [&](const V3& to) {
      return w.bsdfs.eval(surface.bsdf, y.hit.uv_point(), to_light, to);
    };
    const float cosine = std::abs(to_light.z);
    // `even` is the mean of the BSDF over four directions at 45 degrees to the normal, on the lit side, times
    // the cosine of the sun
    const float z = std::copysign(.70710678f, to_light.z);
    float even = 0;
    for (const V3& to : {V3(.5f, .5f, z), V3(-.5f, .5f, z), V3(.5f, -.5f, z), V3(-.5f, -.5f, z)})
      even += mean_component(eval(to).f_cos) * cosine / (4 * std::abs(z));
    look.even = light * std::max(even, kLeastReflected * cosine);
    // A Henyey-Greenstein lobe around the mirrored direction stands for the glossy part of the BSDF. In the
    // mirrored direction the sum of this lobe and the even part equals the BSDF. The lobe is round and as
    // wide as the BSDF's lobe for light along the normal. The BSDF's lobe for light at another angle has this
    // width in one direction only; in the other it is narrower by the factor `cosine`.
    const V3 mirrored(-to_light.x, -to_light.y, to_light.z);
    const BsdfEval at_peak = eval(mirrored);
    const float peak = mean_component(at_peak.f_cos), q = at_peak.pdf * cosine / kInvFourPi;
    if (peak > even && q > 1) {
      look.axis = -y.hit.shading.to_world(mirrored);
      look.g = (2 * q + 1 - std::sqrt(8 * q + 1)) / (2 * q);  // solves (1 + g) / (1 - g)^2 = q
      look.lobe = light * (peak - even) * cosine / q;
    }
  } else {
    look.axis = y.to_light;
    look.g = w.media[y.medium].phase.g;
    look.lobe = light * kInvFourPi;
  }
  return look;
}

namespace {

// If connections to light vertices pay or the settings request them, sets `sun`, `sun_map`, `faint`,
// `connections_per_ray` and Features::connected of a world that is otherwise complete, lowers its `rr_depth`,
// and calls aim() again. The result depends only on the scene, the depth limits and the size of the full
// frame: not on the seed, the number of samples, a crop or the number of threads. The integrator must be
// `volpath` or `path`.
void learn_connections(const IntegratorSettings& settings, int threads, World& w) {
  if (settings.light_vertices < 0 || !w.depth_allows(2)) return;
  // If passed surfaces count towards the maximum depth, there are no connections: light vertices do not
  // record how many null-transmitting surfaces the light has passed
  if (w.passing_counts && w.null_transmission) return;
  // If a medium has an open boundary, there are no connections: the boundary encloses no volume, so a ray
  // from the sun may find another medium behind it than a camera path does
  if (std::any_of(w.geometry.surfaces.begin(), w.geometry.surfaces.end(),
                  [](const SurfaceInfo& s) { return s.transition && s.sheet; }))
    return;
  if (!can_learn(w)) return;
  w.sun = w.lights.strongest_directional();
  if (w.sun.light == kNone) return;
  const bool in_any_case = settings.light_vertices > 0;
  // If the sun is found often, few paths suffice to decide against connections
  Learned learned = learn(w, kLearningPaths, threads, [&](const Connections::Learner& first) {
    return in_any_case || first.lit <= 2 * kLitThatPays * first.vertices;
  });
  if (learned.learner.media_differ || (!in_any_case && !learned.pays())) return;
  learned.learner.map.finish();
  if (learned.learner.map.empty()) return;
  w.sun_map = std::move(learned.learner.map);
  w.faint = kFaintConnection * static_cast<float>(learned.radiance / static_cast<double>(learned.paths));
  w.need.connected = true;
  aim(settings, w);  // again: with connections, points on camera segments pay more often
  w.rr_depth = std::min(w.rr_depth, kConnectedRoulette);
  const FlushDenormals mode;
  const std::size_t count = trace(w, kLearningSeed, 0, kLearningRays).count();
  w.connections_per_ray =
      float{LightVertices::kCandidates * kLearningRays} / static_cast<float>(std::max<std::size_t>(count, 1));
}

// Paths of pilots end after this many segments. In a white, dense medium they would have thousands.
constexpr int kLongestPilot = 64;

std::unique_ptr<const Portals> find_portals(bool in_any_case, int threads, World& w) {
  const PilotSettings settings(w, kLearningSeed, kLongestPortalPath);
  const auto go_on = [&](const Connections::Learner& first) {
    return in_any_case || first.left <= kLeftThatPays * first.scatterings;
  };
  const Learned learned = learn(w, kPortalPaths, threads, go_on, {.sky = true});
  if (!go_on(learned.learner)) return nullptr;
  auto portals = std::make_unique<const Portals>(learned.learner.sky);
  return portals->any() ? std::move(portals) : nullptr;
}

// Sets the portals of a world's lights if they pay or the settings request them. Depends on the same data,
// and requires the same integrators, as learn_connections().
void learn_portals(const IntegratorSettings& settings, int threads, World& w) {
  const bool sky = w.lights.map() || !is_black(w.lights.constant_environment());
  const bool in_any_case = settings.sky_portals > 0;
  if (settings.sky_portals < 0 || !sky || !w.depth_allows(1) || !can_learn(w)) return;
  if (!in_any_case && !pilot_pays(w)) return;
  auto portals = find_portals(in_any_case, threads, w);
  if (!portals) return;
  const bool adds_rays = !w.lights.can_sample(), may_share = w.lights.single_environment_sample();
  const auto without = in_any_case ? std::vector<PilotPixel>{} : pilot_pixels(w, kLongestPilot, threads);
  w.lights.set_portals(std::move(portals));
  aim(settings, w);  // again: next-event estimation may now sample a constant environment
  if (in_any_case) return;
  const auto with = pilot_pixels(w, kLongestPilot, threads);
  const double gain = adds_rays ? kShadowGainThatPays : kPortalGainThatPays;
  if (may_share == w.lights.single_environment_sample() && is_noisier(without, with, gain)) return;
  w.lights.set_portals(nullptr);
  aim(settings, w);
}

// Enables the choice of lights by place if it pays or the settings request it. Depends on the same data, and
// requires the same integrators, as learn_connections().
void learn_local_lights(const IntegratorSettings& settings, int threads, World& w) {
  const bool in_any_case = settings.local_lights > 0;
  if (settings.local_lights < 0 || !w.lights.can_be_local() || !w.depth_allows(1) || !can_learn(w)) return;
  if (!in_any_case && !pilot_pays(w)) return;
  const std::uint64_t lights = w.lights.count();
  const std::uint64_t paths = std::min(kLocalLightPaths, kLocalLightLooks / lights);
  const auto visits_of = [&](std::uint64_t first, std::uint64_t end) {
    const PilotSettings limits(w, kLearningSeed, kLongestLocalLightPath);
    const Lesson lesson{.lights = true, .first_path = first, .batch = kLearningBatch / lights};
    return learn(
               w, end, threads, [](const Connections::Learner&) { return true; }, lesson)
        .learner.lights;
  };
  const std::uint64_t trial = paths / kLocalLightTrial;
  LightVisits visits = visits_of(0, trial);
  if (!in_any_case) {
    if (!(w.lights.spread_over(visits) > kSpreadThatPays)) return;
    // The pilots below render direct light only. It needs no connections, so no light vertices are traced.
    const bool connected = std::exchange(w.need.connected, false);
    constexpr int kDirect = 2;  // segments of paths that show direct light
    const auto without = pilot_pixels(w, kDirect, threads);
    w.lights.set_local(&visits);
    const auto with = pilot_pixels(w, kDirect, threads);
    w.lights.set_local(nullptr);
    w.need.connected = connected;
    if (!is_noisier(without, with, kLocalGainThatPays)) return;
  }
  visits.add(visits_of(trial, paths));
  if (!visits.places.empty()) w.lights.set_local(&visits);
}

// Enables next-event estimation towards emissive grids if it pays or the settings request it. Depends on the
// same data as learn_connections(). The integrator must be `volpath`.
void learn_emissive(const IntegratorSettings& settings, int threads, World& w) {
  const bool in_any_case = settings.emissive_grids > 0;
  if (settings.emissive_grids < 0 || !w.need.emission || !w.depth_allows(1)) return;
  if (!in_any_case && !pilot_pays(w)) return;
  EmissiveGrids grids(w.media);
  if (!grids.any()) return;
  const auto without = in_any_case ? std::vector<PilotPixel>{} : pilot_pixels(w, kLongestPilot, threads);
  w.emissive = std::move(grids);
  if (in_any_case || is_noisier(without, pilot_pixels(w, kLongestPilot, threads), kEmissiveGainThatPays))
    return;
  w.emissive = {};
}

// In scenes with grids, sets up shadow roulette and path splitting. Both need the mean radiance of the image,
// which is estimated here.
void learn_roulette(const IntegratorSettings& settings, World& w) {
  if ((settings.shadow_roulette < 0 && settings.path_splitting < 0) || !w.depth_allows(1)) return;
  const auto mean = static_cast<float>(pilot_radiance(w, kLongestPilot).value_or(0));
  if (!(mean >= std::numeric_limits<float>::min()) || !std::isfinite(mean)) return;
  learn_shadow_roulette(settings, mean, w);
  learn_splitting(settings, mean, w);
}

}  // namespace

LightVertices trace_light_vertices(const World& w, std::uint64_t set) {
  const FlushDenormals mode;
  return trace(w, w.seed, static_cast<std::uint32_t>(set), kSunRays);
}

Result<std::shared_ptr<const World>> build_world(const Scene& scene, const RenderSettings& settings,
                                                 const AssetFiles& files, int threads) {
  auto world = make_world(scene, settings, files, threads);
  if (!world) return tl::unexpected(world.error());
  // The interval of a meter's value counts on pixels whose errors do not depend on each other.
  const bool independent = (*world)->meters.any();
  if (settings.integrator == "volpath" || settings.integrator == "path") {
    learn_portals(scene.integrator, threads, **world);
    if (!independent) learn_connections(scene.integrator, threads, **world);
    learn_local_lights(scene.integrator, threads, **world);
    if (settings.integrator == "volpath") learn_emissive(scene.integrator, threads, **world);
    learn_sky_samples(scene.integrator, **world);
    if (!independent) share_tails(scene.integrator, threads, **world);
    if ((*world)->need.grids && !(*world)->need.connected) learn_roulette(scene.integrator, **world);
  }
  return std::shared_ptr<const World>(std::move(*world));
}

std::shared_ptr<void> limit_threads(int threads) {
  const auto most = static_cast<std::size_t>(std::max(1, threads));
  return std::make_shared<tbb::global_control>(tbb::global_control::max_allowed_parallelism, most);
}

}  // namespace ls::render
