// The path tracer: computes one sample of the radiance along a camera ray.
//
// The hero is the colour channel, drawn once per path, that decides every distance (see medium.h). The state
// of a path is `beta`, its weight relative to the hero, and `density`, each channel's sampling density
// relative to that of the hero. A contribution is beta * light / mean(density): the balance heuristic over
// channels. Direct light is found both by BSDF or phase-function sampling and by next-event estimation,
// combined by the balance heuristic. At surfaces next-event estimation starts from the path's own vertices.
// In media next-event estimation is a strategy, `Light` (VertexNee, the default; SegmentNee;
// CameraSegmentNee), with these members:
//   Plan ahead(path, medium, segment)               called before each flight through a medium: adds light
//                                                   scattered once, anywhere on the segment;
//   Plan::matters()                                 true if vertices on this segment need a Vertex;
//   Vertex vertex(path, medium, plan, t)            the data kept for the vertex at distance t;
//   void at_vertex(path, medium, p, d)              adds light scattered at that vertex;
//   Vertex::found_as_light(), (pivot)               distance density of all next-event estimation, divided by
//                                                   that of free flight: without argument for lights without
//                                                   a position, else for a light with this pivot. It is 1 for
//                                                   a default-constructed Vertex, as on surfaces;
//   Vertex::light_chosen_first()                    true if the vertex's light was chosen by
//                                                   Lights::choose_before_point().
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>

#include "worker/render/base/features.h"
#include "worker/render/integrator/mis.h"
#include "worker/render/integrator/offset_ray.h"
#include "worker/render/integrator/path_records.h"
#include "worker/render/integrator/timed_world.h"
#include "worker/render/integrator/vertex_nee.h"
#include "worker/render/math/sampler.h"
#include "worker/render/media/medium_stack.h"
#include "worker/render/world/near_plane.h"
#include "worker/render/world/overlap.h"
#include "worker/render/world/roulette.h"
#include "worker/render/world/world.h"

namespace ls::render {

// The largest numbers of rays of one path and of surfaces on one shadow ray. A sample that exceeds either is
// rejected and counted. Paths subject to forced roulette (below) reach the limit with probability e^-60.
inline constexpr int kMaxSegments = 1 << 20;
inline constexpr int kMaxShadowSegments = 1 << 16;
// From kForcedRouletteDepth scatterings on, roulette may end even paths that lose no energy; otherwise
// nothing would end a path in a closed white room. After n scatterings the survival probability is n / (n +
// 1), so a share of 1024 / n of these paths reaches n scatterings, and weights grow only linearly. A constant
// survival probability q would have infinite variance in dense media: in a white slab of optical depth tau, a
// share exp(-n pi^2 / (3 (tau + 1.42)^2)) of the light is still inside after n scatterings, and the variance
// is finite only where 1 - q is below the rate of this decay, pi^2 / (3 (tau + 1.42)^2). Beyond
// kLastRouletteDepth q is constant, as otherwise the length of paths in a white room would have no mean; the
// variance is then finite up to tau = 230, where a path has 5500 vertices on average.
inline constexpr int kForcedRouletteDepth = 1024;
inline constexpr int kLastRouletteDepth = 1 << 16;
inline constexpr float kLastSurvival = 1 - 0x1p-14f;
// In media that lose no light, light subpaths (paths from the sun) would be so long that their vertices fill
// the memory. So from kMostUnforced scatterings on, a light subpath survives each scattering with probability
// kForcedLight at most.
inline constexpr int kMostUnforced = 8;
inline constexpr float kForcedLight = .5f;
constexpr float forced_survival(int depth) {
  if (depth < kForcedRouletteDepth) return 1;
  if (depth >= kLastRouletteDepth) return kLastSurvival;
  return static_cast<float>(depth) / static_cast<float>(depth + 1);
}

// Where shadow rays and scattered rays may meet different surfaces (visibility.h), light from a direction
// that a surface samples with more than this density, per steradian, is that which the scattered ray meets,
// as in a mirror. Diffuse surfaces are far below, at most 1 / pi; the peak of a lobe of roughness alpha is
// about 1 / (4 pi alpha^2).
inline constexpr float kLikeMirror = 1;

enum class Collision : std::uint8_t {
  escaped,    // the path reached the end of the segment
  absorbed,   // the path ends here
  scattered,  // the path goes on in a new direction, if it survives Russian roulette
};

template <Features F>
class SegmentNee;

template <Features F, template <Features> class Light = VertexNee>
class PathTracer : TimedWorld<F.motion> {
 public:
  // The sample's radiance is added to the components in `split`. `split` is required with F.split and ignored
  // otherwise; in the same way F.connected requires `connections`.
  PathTracer(const World& world, const SampleStream& stream, LightSplit* split = nullptr,
             Connections connections = {})
      : Timed(world), stream_(stream), split_(split), connections_(connections) {}

  SampleOutcome trace(const CameraRay& ray);
  // The first surface at which the path would be scattered if there were no media. The AOVs describe this
  // surface.
  std::optional<FirstSurface> first_surface(const CameraRay& ray);
  // Returns the albedo and the normal of the first surface that is not an index-matched boundary, a mirror or
  // clear glass, seen through the surfaces before it.
  DenoisingGuide denoising_guide(const CameraRay& ray);
  // Returns one sample of how much of what is behind the scene does not reach the camera along this ray.
  // Unless it is null, `deep` receives what the same sample says of the slices of a deep image.
  Opacity opacity(const CameraRay& ray, const DeepTransmittance* deep = nullptr);
  // Follows a ray through boundaries and surfaces that light passes straight through.
  DeepProbe deep_probe(const CameraRay& ray);
  // With F.connected: follows a ray of the sun, and calls keep(vertex) for each light vertex on its way.
  // Camera paths are connected to light vertices (light_vertices.h).
  template <class Keep>
  void follow_light(const SunMap::Ray& ray, const Keep& keep);
  // With F.reuse: share() adds to each path the light that all paths found from their second vertices on. The
  // paths must have been traced and belong to different pixels. sort_to_share() puts those that gain most
  // from each other side by side.
  static void sort_to_share(std::span<PathTracer*> paths);
  static void share(std::span<PathTracer* const> group);
  const SampleOutcome& outcome() const { return outcome_; }
  // With F.connected: the number of the path's rays so far, plus the boundaries that its shadow rays passed.
  std::uint64_t rays() const { return static_cast<std::uint64_t>(segment_) + boundaries_; }

 private:
  using Timed = TimedWorld<F.motion>;
  using Timed::begin, Timed::complete, Timed::sample_light, Timed::light_pivot;
  using Timed::world_, Timed::nearest, Timed::nearest_boundary, Timed::between, Timed::occluded;
  friend class Light<F>;
  friend class VertexNee<F>;
  friend class SegmentNee<F>;
  // True if paths may split (roulette.h): worlds with Features::connected or Features::reuse never do.
  static constexpr bool kSplits = F.grids && !F.connected && !F.reuse;
  struct Vertex {  // where the current ray was scattered
    V3 p{0, 0, 0};
    LightPlace place;  // the point and normal for which lights are chosen
    V3 ng{0, 0, 0};    // with F.connected: the geometric normal
    float pdf = 0;     // density, per steradian, of the sampled direction
    // True if a delta lobe or the camera sampled the direction. Lights that the ray hits then have full
    // weight.
    bool delta = true;
    float sum = 0;  // with F.connected: SubpathDensities::sum() of the path up to here
    typename Light<F>::Vertex in_medium;
  };

  struct Step {
    Collision collision;
    float roulette = 1;  // random number for Russian roulette, if scattered
  };
  using Within = std::conditional_t<F.overlaps, MediaState, OneMedium>;
  // True if a flight may be sampled before its ray is traced. Other features and strategies need the end of
  // the segment first.
  static constexpr bool kFliesFirst =
      F.media && !F.aimed && !F.reuse && std::is_same_v<Light<F>, VertexNee<F>>;

  // Begins the path of a meter, which sees what surfaces see: not what is hidden from cameras alone. Returns
  // false if it ends at the meter's plate.
  [[gnu::cold, gnu::noinline]] bool begin_at_meter(const CameraRay& ray);
  // Follows the path from its current vertex to its end. The first ray of the path ends at t_max.
  void go_on(float t_max);
  // Samples a free flight up to the surface hit at `end`, or, if `end` is null, up to the distance `reach`.
  // If the flight was sampled before the ray was traced (kFliesFirst), `flown` is this flight, sampled
  // without an upper limit.
  Step fly(const SurfaceHit* end, float reach, const std::optional<Flight>& flown);
  Step fly_through(const Medium& medium, const SurfaceHit* end, float reach,
                   const std::optional<Flight>& flown);
  Step fly_through_several(const SurfaceHit* end, float reach);
  Flight flight_through(const Medium& medium, float t_max);
  Step collide(const Medium& medium, Segment segment, const typename Light<F>::Plan& plan,
               const Flight& flight);
  // Returns the medium of `in` if it is the only one and p is in its clear region (a part of the medium
  // without surfaces: clear_region.h), else null.
  const Medium* clear_medium(const Within& in, const V3& p) const {
    if (!in.any() || in.several()) return nullptr;
    const Medium& m = world_.media[in.one()];
    return m.clear && m.clear->contains(p) ? &m : nullptr;
  }
  void begin_vertex(Segment segment, const Flight& flight);
  Step scatter_in(const Medium& medium);
  Step scatter_by_phase(const Medium& medium);
  void light_vertex(const Medium& medium, const V3& p, const V3& d);
  void light_vertex_by(const LightChoice& choice, const Medium& medium, const V3& p, const V3& d);
  void add_medium_emission_among(float t_max);
  float others_end(std::size_t but, int hero, float t_max, RandomStream streams);
  void add_medium_emission(const Medium& medium, float t_max);
  C3 closed_emission(const Medium& medium, float t) const;
  float emissive_weight(const Medium& medium);
  void look_for_emission_on(const SurfaceHit& hit, const V3& wo);
  void look_for_emission_in(const Medium& medium, const V3& d);
  void add_emission_at(const EmissiveGrids::Point& point, const C3& weight, OffsetRay ray, Within medium,
                       RandomStream& stream);
  Step scatter_on_surface(const SurfaceHit& hit);
  bool passes_null(const SurfaceHit& hit);
  bool may_scatter() const { return world_.depth_allows(depth_ + 1); }
  // True if the depth limit allows another segment after this many scatterings and after `passed` crossings
  // of index-matched boundaries and null-transmitting surfaces.
  bool may_go_on(int scatterings, int passed) const {
    return world_.depth_allows(scatterings + (world_.passing_counts ? passed : 0));
  }
  void pass_boundary(const SurfaceHit& hit, const SurfaceInfo& surface);
  void light_surface(const SurfaceHit& hit, const V3& wo);
  [[gnu::always_inline]] inline void light_surface_by(const LightChoice& choice, const SurfaceHit& hit,
                                                      const SurfaceInfo& surface, const V3& wo);
  template <class LookFor>
  void learn_lights(const LightPlace& place, const LookFor& look_for);
  // Returns the place in the medium for which lights are chosen on the segment ahead.
  LightPlace place_on(const Segment& segment) const {
    return {Lights::place_on(ray_.start, ray_.d, segment.length), V3(0)};
  }
  void look_for_sky(const SurfaceHit& hit, const SurfaceInfo& surface, const V3& wo, Group numbers);
  // The density with which a vertex in a medium at p samples the direction w; `own` is the density of the
  // phase function.
  float direction_pdf([[maybe_unused]] const V3& p, float own, [[maybe_unused]] const V3& w) const {
    if constexpr (F.aimed) return LampDirections(world_.lamps, p).pdf(own, w);
    return own;
  }
  std::optional<BsdfSample> sample_bsdf(const SurfaceHit& hit, const SurfaceInfo& surface, const V3& wo,
                                        const Group& g);
  void add_emission(const SurfaceHit& hit);
  void add_emission_times(const C3& beta, const SurfaceHit& hit);
  void add_environment();
  [[gnu::cold, gnu::noinline]] void add_environment_seen();
  bool meet(SurfaceHit& hit, float reach, RayKind kind) const;
  // True if a camera ray passes straight through the surface; false if it ends there.
  bool sees_past(const SurfaceHit& hit, const SurfaceInfo& surface) {
    return surface.hidden.has(RayKind::camera) || surface.null ||
           (surface.null_transmission && passes_null(hit));
  }
  // With F.visibility (visibility.h): the kind of the path's current ray.
  RayKind ray_kind() const {
    if (depth_ == 0) return RayKind::camera;
    return left_medium_ ? RayKind::medium : RayKind::surface;
  }
  // The receivers and blockers of the light that was hit
  const LightReach& reach_of(const SurfaceHit& hit) const {
    return world_.lights.reach(world_.geometry.surfaces[hit.surface].light);
  }
  // True if shadow rays alone find the light of a light of this reach that arrives at the last vertex.
  bool found_by_shadows(const LightReach& reach) const {
    return depth_ > 0 && !last_.delta &&
           (reach.has_blockers() || (world_.direct_by_shadows && !like_mirror_));
  }
  // True if light of the chosen light from a direction that a surface samples with this density is not looked
  // for by shadow rays.
  bool is_like_mirror(float pdf, const LightChoice& choice) const {
    if constexpr (F.visibility)
      return world_.direct_by_shadows && pdf > kLikeMirror &&
             !world_.lights.reach(choice.light).has_blockers();
    return false;
  }
  // True if the light that the current ray hits, of this reach or there, has full weight.
  bool hits_count_fully(const LightReach& reach) const {
    return last_.delta || (like_mirror_ && !reach.has_blockers());
  }
  bool hits_count_fully(const SurfaceHit& hit) const {
    if constexpr (F.visibility) return hits_count_fully(reach_of(hit));
    return last_.delta;
  }
  // Returns whether a surface or a medium receives the chosen light. From this call on shadow rays are those
  // of this light.
  bool turn_to(const LightChoice& choice, const SurfaceHit& hit);
  bool turn_to(const LightChoice& choice, const Medium& medium);
  bool turn_to(const LightReach& reach, RayKind kind, scene::LinkMask links);
  std::size_t index_of(const Medium& medium) const {
    return static_cast<std::size_t>(&medium - world_.media.data());
  }
  // True if rays of this kind pass straight through the surface because it is hidden from them.
  bool is_hidden(std::uint32_t surface, RayKind kind) const;
  [[gnu::cold, gnu::noinline]] void add_environment_times(const C3& beta, bool by_shadows);
  [[gnu::cold, gnu::noinline]] void add_direct();
  void add_direct_past(scene::LinkIndex blockers);
  [[gnu::cold, gnu::noinline]] C3 shadow_at(const SurfaceHit& hit);
  bool meets_catcher(const V3& p, const LightSample& light) const;
  C3 unoccluded(const V3& start, const V3& p, const LightSample& light, const Within& medium,
                RandomStream stream);
  [[gnu::always_inline]] inline C3 through_boundaries(C3 value, const V3& start, const V3& p, const V3& d,
                                                      float left, Within medium, RandomStream stream);
  C3 through_media(const Within& media, const V3& from, const V3& d, float t, RandomStream& stream) const;
  // Returns the media in which a camera ray begins.
  Within start_medium(const CameraRay& ray) const;
  // Requires that `surface` is the surface of `hit`. The function is described at its definition
  // (medium_crossing.h).
  [[gnu::always_inline]] inline Within beyond(const SurfaceHit& hit, const SurfaceInfo& surface, const V3& w,
                                              const V3& from, Within in) const;
  void stand(const SurfaceInfo& s, bool outside, bool through, Within& in) const;
  CoincidentHits others_at(const SurfaceHit& hit, const V3& from, const V3& w) const;
  [[gnu::noinline]] Within through_all(const SurfaceHit& hit, const V3& w, const V3& from, Within in) const;
  template <bool kHidden = F.visibility>
  [[gnu::noinline]] void prefer_scatterer(SurfaceHit& hit, const V3& o, const V3& d, float t_max,
                                          RayKind kind) const;
  [[gnu::noinline]] void add_emission_of_others(const SurfaceHit& hit);
  bool survives(float u);
  // Returns the throughput by which survives() decides whether Russian roulette may end the path.
  float size() const;
  void refer_to_first_vertex();
  void prefetch_light_vertices() const {
    if (connections_.vertices)
      connections_.vertices->prefetch(stream_.group(depth_, Purpose::connect).bits[0]);
  }
  void connect_in(const Medium& medium, const V3& p, const V3& d);
  void connect_on(const SurfaceHit& hit, const SurfaceInfo& surface, const V3& wo);
  template <class Scattering>
  void connect(const Receiver& x, const V3& start, const Scattering& scattering);
  // Returns the density of the light vertices that the sun lights directly, times the number of light
  // vertices among which a connection chooses. The density is per area of a surface with normal ng or, in a
  // medium (ng = 0), per area perpendicular to the sun's rays. `rays` is the density with which rays from the
  // sun are traced, per area perpendicular to them.
  float first_density(float rays, const V3& ng) const {
    return world_.connections_per_ray * rays * (is_black(ng) ? 1 : std::abs(dot(ng, world_.sun.direction)));
  }
  void arrive(const Vertex& from, const V3& p, const V3& ng);

  // With F.reuse: how the second vertex of a path's tail looks from the first vertex of another path.
  struct Look {
    V3 w{0, 0, 0};      // the direction towards the second vertex
    C3 value{0, 0, 0};  // light at the camera per radiance that the second vertex scatters towards the first
    // The density, per area or volume, with which this path finds the second vertex; 0 if it cannot find it
    float density = 0;
  };
  void begin_sharing(const SurfaceHit* hit, const Medium* medium);
  void look_for_second();
  template <class Accepts>
  void begin_tail(const PathVertex& at, const LightPlace& place, const V3& start, const Accepts& accepts);
  void go_on_as_tail(const V3& w, const C3& weight);
  Look look_at(const SharedTail& tail, bool own);
  BsdfEval scattered_at_first(const V3& wi);
  class TowardsGroup;
  BsdfEval scattered_at(const PathVertex& y, const V3& d, const V3& w) const;
  void add_shared(const C3& light) {
    outcome_.radiance += light;
    if constexpr (F.split) {
      split_->parts[static_cast<std::size_t>(part_of(2, first_in_medium_))] += light;
      if (split_->by_depth.wanted) split_->by_depth.add(light);
    }
  }
  void add_shared_to_group(LightGroup group, const C3& light) {
    split_->add_to_group(group, part_of(2, first_in_medium_), light);
  }
  bool looks_for_second() const {
    if constexpr (F.reuse) return sharing_.part == SharingPath::Part::second;
    return false;
  }
  // True while the path is on the way from its second vertex to its third.
  bool is_leaving_second() const { return sharing_.part == SharingPath::Part::tail && depth_ == 2; }
  void keep_emitted(const C3& emitted, float pdf, LightGroup group);

  // Returns densities_.sum(back()). Calls back() only if the sum depends on it.
  template <class Back>
  float densities_sum(const Back& back) const {
    return densities_.sum(densities_.needs_back() ? back() : 0);
  }

  // Adds light that next-event estimation found at the current vertex p, in the direction `to_light`. ng is
  // the geometric normal at p, or 0 in a medium. back() returns the density with which a path from the light
  // would be scattered back along this path.
  template <class Back>
  void add_found([[maybe_unused]] const LightChoice& choice, [[maybe_unused]] const V3& p,
                 [[maybe_unused]] const V3& ng, [[maybe_unused]] const V3& to_light, C3 light,
                 [[maybe_unused]] const Back& back) {
    if constexpr (F.connected) {
      if (connections_.learner && world_.lights.is_sky(choice))
        connections_.learner->found_sky(p, to_light, mean(light));
      if (choice.light == world_.sun.light && densities_.last > 0) {
        if (connections_.vertices)
          light /= 1 + first_density(world_.sun_map.density(p), ng) * densities_sum(back);
        if (connections_.learner) {
          connections_.learner->map.learn(p, std::sqrt(mean(light)));
          connections_.learner->light += double{mean(light)};
          connections_.learner->lit += 1 / double{choice.probability};
        }
      }
    }
    add(light, group_of(choice));
  }

  // With F.split: the light group of a chosen light.
  LightGroup group_of([[maybe_unused]] const LightChoice& choice) const {
    if constexpr (F.split) return world_.lights.group(choice.light);
    return kNoLightGroup;
  }
  // Adds `weighted`, light of this group multiplied by beta_, to the sample. If `ahead`, this light was
  // scattered once more than the path so far, in the medium on the path's next segment.
  void add(const C3& weighted, [[maybe_unused]] LightGroup group, bool ahead = false) {
    C3 light = weighted;
    if constexpr (F.chromatic) light = weighted / mean(density_);
    if constexpr (F.reuse) {
      if (sharing_.part == SharingPath::Part::tail) {
        sharing_.tail.scattered += light;
        if constexpr (F.split) tail_by_group_.add(group, light);
        return;
      }
      light *= sharing_.scale;
    }
    outcome_.radiance += light;
    if constexpr (F.split) {
      const LightPart part = part_ahead(ahead);
      split_->parts[static_cast<std::size_t>(part)] += light;
      split_->add_to_group(group, part, light);
      if (split_->by_depth.wanted) split_->by_depth.add(light);
    }
  }
  // With F.split: tells the depths of a deep image that the path, if it was not scattered yet, is scattered
  // at p or finds light there.
  void see([[maybe_unused]] const V3& p) {
    if constexpr (F.split)
      if (depth_ == 0 && split_->by_depth.wanted) split_->by_depth.see(split_->by_depth.depth(p, ray_.d));
  }
  void see_surface([[maybe_unused]] const V3& p) {
    if constexpr (F.split)
      if (depth_ == 0 && split_->by_depth.wanted)
        split_->by_depth.see(split_->by_depth.depth(p, ray_.d), true);
  }
  void see_environment() {
    if constexpr (F.split)
      if (depth_ == 0 && split_->by_depth.wanted) split_->by_depth.see(kInfinity);
  }
  template <class UpTo>
  void add_along(const C3& total, const Medium& medium, float t_max, const UpTo& up_to);
  LightPart part_ahead(bool ahead) const {
    return part_of(depth_ + ahead, depth_ == 0 ? ahead : first_in_medium_);
  }
  // With F.split: adds `weighted` to the group alone. The caller has added it to the sample, with other
  // light, without a group.
  void add_to_group(LightGroup group, const C3& weighted) {
    C3 light = weighted;
    if constexpr (F.chromatic) light = weighted / mean(density_);
    if constexpr (F.reuse) {
      if (sharing_.part == SharingPath::Part::tail) return tail_by_group_.add(group, light);
      light *= sharing_.scale;
    }
    split_->add_to_group(group, part_ahead(false), light);
  }
  static float mean(const C3& c) { return (c.x + c.y + c.z) / 3; }
  void apply(const Flight& f) {
    beta_ *= f.weight;
    if constexpr (F.chromatic) density_ *= f.density;
  }

  SampleStream stream_;
  LightSplit* split_;
  OffsetRay ray_;
  C3 beta_{1, 1, 1}, density_{1, 1, 1};
  // Russian roulette may end the path if its throughput is below reference_ (roulette.h). In worlds where
  // reference_ depends on the path's first vertex, it is kNoReference before that vertex.
  float reference_ = 1;
  static constexpr float kNoReference = -1;
  // Factor by which size() cancels the scaling of radiance by the path's refractions
  float eta_scale_ = 1;
  int hero_ = 0;
  int depth_ = 0;                 // scatterings so far
  int passed_ = 0;                // index-matched and null-transmitting surfaces passed so far
  std::uint64_t boundaries_ = 0;  // with F.connected: number of boundaries that shadow rays passed
  int segment_ = 0;               // number of the current ray; a new ray begins behind each passed surface
  Within medium_;
  bool looked_for_sky_ = false;   // true if look_for_sky() sampled a second direction at the first vertex
  bool first_in_medium_ = false;  // with F.split: true if the first scattering was in a medium
  // Both with F.visibility. left_medium_: true if the last scattering was in a medium. direct_due_: true if
  // add_direct() has to look for light in the direction of the current ray.
  bool left_medium_ = false, direct_due_ = false;
  // With F.visibility: true if the last direction was scattered as if by a mirror (kLikeMirror)
  bool like_mirror_ = false;
  Vertex last_;
  SubpathDensities densities_;  // with F.connected: densities of the path up to the current vertex
  Connections connections_;
  SampleOutcome outcome_;
  MediumCounters counters_;
  // With F.aimed: near_lamps_ is the distribution from which the current vertex samples directions close to
  // lamps (lights without extent), and aim_ is the density of the BSDF or phase function divided by the
  // density with which the last direction was sampled. Russian roulette excludes this factor: the closer a
  // direction is to a lamp, the smaller the factor is and the brighter the light that the direction leads to.
  LampDirections near_lamps_;
  float aim_ = 1;
  struct Nothing {};
  struct Links {
    scene::LinkMask receiver = 0;                    // the lists that have what the last vertex is on or in
    scene::LinkIndex blockers = scene::kEverything;  // the list of the light of shadow rays
  };
  std::conditional_t<F.visibility, Links, Nothing> links_;
  struct Emissive {
    // The density with which the last vertex found the direction of the current ray by looking for emissive
    // grids; negative if it is not known yet
    float pdf = -1;
  };
  std::conditional_t<F.emission, Emissive, Nothing> emissive_;
  std::conditional_t<F.reuse, SharingPath, Nothing> sharing_;
  std::conditional_t<F.reuse && F.split, TailByGroup, Nothing> tail_by_group_;
};

template <Features F, template <Features> class Light>
SampleOutcome PathTracer<F, Light>::trace(const CameraRay& ray) {
  if (!world_.depth_allows(0)) return outcome_;
  ray_ = begin(ray);
  last_.p = ray.o;
  if constexpr (F.split)
    if (split_->by_depth.wanted) split_->by_depth.begin(ray.o, world_.camera.near_distance(ray));
  if constexpr (F.media) medium_ = start_medium(ray);
  if constexpr (F.chromatic) hero_ = std::min(2, static_cast<int>(3 * stream_.group(0, Purpose::hero).u(0)));
  if constexpr (kSplits) reference_ = world_.mean_radiance > 0 ? kNoReference : 1;
  if constexpr (!F.reuse) {
    if (ray.meter && !begin_at_meter(ray)) [[unlikely]]
      return outcome_;
  }
  go_on(ray.t_max);
  return outcome_;
}

template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::begin_at_meter(const CameraRay& ray) {
  const MeterStart& meter = *ray.meter;
  SurfaceHit plate;
  plate.p = ray.o;
  plate.ng = meter.has_plate() ? -ray.d : ray.d;
  plate.shading = Frame(plate.ng);
  plate.surface = world_.plate;
  plate.reach = meter.reach;
  if constexpr (F.media) {
    const MediaState media =
        meter.media ? *meter.media : media_at(world_, offset_point(plate, plate.ng), meter.ambience);
    if constexpr (F.overlaps)
      medium_ = media;
    else
      medium_.only(media.any() ? media.one() : kNone);
  }
  if (!meter.has_plate()) {
    ray_.leave(plate, ray.d);
    depth_ = 1;
    if constexpr (F.visibility) links_.receiver = world_.surface_links[world_.plate];
    return true;
  }
  last_.p = ray.o + plate.ng;  // the path comes from anywhere in front of the plate
  const Step step = scatter_on_surface(plate);
  return step.collision == Collision::scattered && survives(step.roulette);
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::go_on(float t_max) {
  for (; segment_ < kMaxSegments; ++segment_, t_max = kInfinity) {
    if constexpr (F.visibility) {
      if (direct_due_) add_direct();
    }
    std::optional<Flight> flown;
    if constexpr (kFliesFirst) {
      const Medium* const medium = std::isfinite(t_max) ? nullptr : clear_medium(medium_, ray_.start);
      if (medium) {
        flown = flight_through(*medium, kInfinity);
        if (flown->scattered && medium->clear->contains(ray_.start + ray_.d * flown->t)) {
          const Step step = collide(*medium, {kInfinity, ray_.lead(), nullptr}, {}, *flown);
          if (step.collision == Collision::absorbed || !survives(step.roulette)) break;
          continue;
        }
        if (!flown->scattered && medium->clear->way_out(ray_.start, ray_.d)) {
          apply(*flown);
          if (world_.depth_allows(depth_)) add_environment();
          break;
        }
      }
    }
    SurfaceHit hit;
    const auto primitive = nearest(ray_.origin, ray_.d, t_max);
    const bool met = primitive && complete(*primitive, ray_.origin, ray_.d, hit);
    if constexpr (F.overlaps) {
      if (met && world_.coincident)
        prefer_scatterer(hit, ray_.origin, ray_.d, kInfinity, F.visibility ? ray_kind() : RayKind::camera);
    }
    if constexpr (F.media) {
      if (medium_.any()) {
        const Step step = fly(met ? &hit : nullptr, t_max, flown);
        if (step.collision == Collision::scattered) {
          if (!survives(step.roulette)) break;
          continue;
        }
        if (step.collision == Collision::absorbed || !world_.depth_allows(depth_) || is_black(beta_)) break;
      }
    }
    if (!met) {
      // A ray with a non-finite direction hits nothing, and the sample is rejected. A sample that was
      // rejected before keeps its cause.
      if (is_finite(ray_.d))
        add_environment();
      else
        outcome_.reject(HealthCause::no_direction);
      break;
    }
    const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
    if constexpr (F.visibility) {
      if (surface.hidden.any() || surface.holdout) [[unlikely]] {
        const bool hidden = surface.hidden.has(ray_kind());
        if (hidden || (depth_ == 0 && surface.holdout)) {
          if (!hidden && !sees_past(hit, surface)) break;
          pass_boundary(hit, surface);
          if (is_black(beta_)) break;
          continue;
        }
      }
    }
    if constexpr (F.overlaps) {
      if (world_.lights_on_others && surface.coincident_reach > 0) add_emission_of_others(hit);
    }
    if (!surface.plain) {
      if (surface.light != kNone) add_emission(hit);
      if constexpr (F.passing) {
        if (surface.null || (surface.null_transmission && passes_null(hit))) {
          if (!may_go_on(depth_, ++passed_)) break;
          pass_boundary(hit, surface);
          if (is_black(beta_)) break;
          continue;
        }
      }
    }
    if constexpr (F.whitted) {
      if (!last_.delta) break;
    }
    const Step step = scatter_on_surface(hit);
    if (step.collision == Collision::absorbed || !survives(step.roulette)) break;
  }
  if (segment_ == kMaxSegments) outcome_.reject(HealthCause::too_many_surfaces);
  if constexpr (F.overlaps)
    if (medium_.overflowed()) outcome_.reject(HealthCause::nested_media);
  outcome_.majorant_violations += counters_.majorant_violations;
}

// Scatters the path at a surface. Returns Collision::absorbed if the surface absorbs the path, or if the path
// has reached its maximum depth.
template <Features F, template <Features> class Light>
auto PathTracer<F, Light>::scatter_on_surface(const SurfaceHit& hit) -> Step {
  if (!may_go_on(depth_ + 1, passed_)) return {Collision::absorbed};
  see_surface(hit.p);
  ++depth_;
  if constexpr (F.visibility) left_medium_ = false;
  const SurfaceInfo& surface = world_.geometry.surfaces[hit.surface];
  const V3 wo = hit.shading.to_local(-ray_.d);
  if constexpr (F.aimed)
    near_lamps_ = surface.smooth ? LampDirections(world_.lamps, hit.p) : LampDirections();
  if constexpr (F.connected) {
    arrive(last_, hit.p, hit.ng);
    if (hit.normal_replaced) densities_ = {};
    prefetch_light_vertices();
  }
  if constexpr (F.reuse) {
    const bool shared = surface.smooth && !hit.normal_replaced;
    if (shared) begin_sharing(&hit, nullptr);
    if (shared && looks_for_second()) {
      begin_tail({hit.p, nullptr, hit}, {hit.p, hit.shading.n}, hit.p,
                 [&](const V3& w) { return (dot(w, hit.shading.n) > 0) == (dot(w, hit.ng) > 0); });
    } else {
      light_surface(hit, wo);
    }
  } else {
    light_surface(hit, wo);
  }
  if constexpr (F.connected) {
    if (surface.smooth) connect_on(hit, surface, wo);
  }
  if constexpr (F.emission) look_for_emission_on(hit, wo);
  const Group g = stream_.group(depth_, Purpose::direction);
  if (depth_ == 1 && world_.sky_samples && surface.smooth) look_for_sky(hit, surface, wo, g);
  const auto s = sample_bsdf(hit, surface, wo, g);
  if (!s) return {Collision::absorbed};
  const V3 w = normalize(hit.shading.to_world(s->wi));
  // The path is absorbed if w lies on different sides of the surface by its geometric and by its shading
  // normal.
  if ((dot(w, hit.ng) > 0) != (s->wi.z > 0)) return {Collision::absorbed};
  if constexpr (F.reuse) {
    if (looks_for_second() && sharing_.tail.usable && !s->delta && !is_black(s->weight)) {
      go_on_as_tail(w, s->weight);
    } else {
      beta_ *= s->weight;
      if (looks_for_second()) sharing_.part = SharingPath::Part::alone;
      if (depth_ == 1 && sharing_.first.usable && !s->delta && !is_black(beta_)) look_for_second();
    }
  } else {
    beta_ *= s->weight;
  }
  if (s->transmitted) eta_scale_ *= s->eta * s->eta;
  last_ = Vertex{};
  last_.p = hit.p;
  last_.place = {hit.p, hit.shading.n};
  last_.pdf = s->pdf;
  last_.delta = s->delta;
  if constexpr (F.emission) emissive_.pdf = -1;
  if constexpr (F.visibility) {
    if (world_.ray_flags) [[unlikely]] {
      links_.receiver = world_.surface_links[hit.surface];
      float pdf = s->pdf;
      if constexpr (F.aimed) pdf *= aim_;
      like_mirror_ = world_.direct_by_shadows && !s->delta && pdf > kLikeMirror;
      direct_due_ = !world_.shadow_lists.empty() && !s->delta;
    }
  }
  if constexpr (F.connected) {
    last_.ng = hit.ng;
    last_.sum = densities_sum([&] { return world_.bsdfs.eval(surface.bsdf, hit.uv_point(), s->wi, wo).pdf; });
  }
  // Reflected rays too get the medium that the surface declares for their side, as shadow rays do. It may
  // differ from the medium in which the path arrived.
  if constexpr (F.media) medium_ = beyond(hit, surface, w, ray_.d, medium_);
  ray_.leave(hit, w);
  return {Collision::scattered, g.u(3)};
}

template <Features F, template <Features> class Light>
std::optional<BsdfSample> PathTracer<F, Light>::sample_bsdf(const SurfaceHit& hit, const SurfaceInfo& surface,
                                                            const V3& wo, const Group& g) {
  float choice = g.u(2);
  if constexpr (F.aimed) {
    aim_ = 1;
    if (const auto w = near_lamps_.sample(choice, {g.u(0), g.u(1)})) {
      BsdfSample s;
      s.wi = hit.shading.to_local(*w);
      const BsdfEval f = world_.bsdfs.eval(surface.bsdf, hit.uv_point(), wo, s.wi);
      if (is_black(f.f_cos)) return std::nullopt;
      s.pdf = near_lamps_.pdf(f.pdf, *w);
      aim_ = f.pdf / s.pdf;
      s.weight = f.f_cos * (1 / s.pdf);
      s.transmitted = (s.wi.z > 0) != (wo.z > 0);
      return s;
    }
  }
  auto s = world_.bsdfs.sample(surface.bsdf, hit.uv_point(), wo, choice, {g.u(0), g.u(1)});
  if constexpr (F.aimed) {
    if (!s || !near_lamps_.any()) return s;
    const float own = s->pdf;
    s->pdf = s->delta ? own * near_lamps_.own_share()
                      : near_lamps_.pdf(own, normalize(hit.shading.to_world(s->wi)));
    aim_ = own / s->pdf;
    s->weight *= aim_;
  }
  return s;
}

// Decides whether the path passes straight through a null-transmitting surface. A path that passes makes no
// vertex, and its depth does not increase. A light that it hits behind the surface is weighted against
// next-event estimation from the previous vertex, whose shadow rays pass the surface with the same
// transmission (through_boundaries). The random numbers are keyed by segment, since those of a vertex would
// be used again at the next surface.
template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::passes_null(const SurfaceHit& hit) {
  const BsdfIndex bsdf = world_.geometry.surfaces[hit.surface].bsdf;
  const NullTransmission null_transmission =
      world_.bsdfs.null_transmission(bsdf, hit.uv_point(), hit.shading.to_local(-ray_.d));
  if (!(null_transmission.probability > 0)) return false;
  if (stream_.group(segment_, Purpose::null_transmission).u(0) < null_transmission.probability) {
    beta_ *= null_transmission.transmission / null_transmission.probability;
    if constexpr (F.reuse) {
      if (looks_for_second()) {
        sharing_.tail.transmission *= null_transmission.transmission;
        sharing_.tail.passing *= null_transmission.probability;
      }
    }
    return true;
  }
  beta_ /= 1 - null_transmission.probability;
  return false;
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::pass_boundary(const SurfaceHit& hit, [[maybe_unused]] const SurfaceInfo& surface) {
  ray_.leave(hit, ray_.d);
  if constexpr (F.media) medium_ = beyond(hit, surface, ray_.d, ray_.d, medium_);
}

template <Features F, template <Features> class Light>
float PathTracer<F, Light>::size() const {
  float size = max_component(beta_) * eta_scale_;
  if constexpr (F.reuse) size *= sharing_.survival;
  if constexpr (F.aimed) size /= std::min(aim_, 1.f);
  if constexpr (F.chromatic) size /= mean(density_);
  return size;
}

template <Features F, template <Features> class Light>
void PathTracer<F, Light>::refer_to_first_vertex() {
  reference_ = roulette_reference(size(), mean(outcome_.radiance), world_.mean_radiance);
}

// Russian roulette with the random number u. Returns false if the path ends.
template <Features F, template <Features> class Light>
bool PathTracer<F, Light>::survives(float u) {
  if (is_black(beta_)) return false;
  if constexpr (kSplits) {
    if (reference_ == kNoReference) refer_to_first_vertex();
  }
  if (depth_ < world_.rr_depth) return true;
  const float q = std::min(kSplits ? size() / reference_ : size(), forced_survival(depth_));
  if (q >= 1) return true;
  if (!(u < q)) return false;
  beta_ /= q;
  return true;
}

}  // namespace ls::render

#include "worker/render/integrator/aov_rays.h"
#include "worker/render/integrator/emission_nee.h"
#include "worker/render/integrator/light_hits.h"
#include "worker/render/integrator/medium_crossing.h"
#include "worker/render/integrator/path_reuse.h"
#include "worker/render/integrator/shadow_ray.h"
#include "worker/render/integrator/surface_nee.h"
#include "worker/render/integrator/vertex_connection.h"
#include "worker/render/integrator/visibility.h"
