// The features that a scene needs of the integrator. A variant is the integrator compiled for one set of
// features: it may leave code out, but it never changes the use of random numbers or the order of arithmetic.
// So all variants that have the features of a scene render it to the same bits
// (docs/decisions/0012-what-a-scene-needs.md).
#pragma once

namespace ls::render {

struct Features {
  bool media = false;      // there are participating media
  bool grids = false;      // there are heterogeneous media
  bool chromatic = false;  // the extinction of some medium differs between channels
  bool emission = false;   // some medium emits light
  // The scene has nested or intersecting media (medium_stack.h), or coincident surfaces of which some rays
  // pass one, since it is null, that is, index-matched, or hidden (coincident.h).
  bool overlaps = false;
  // The scene has surfaces that light passes straight through: index-matched boundaries, masks, thin
  // dielectrics.
  bool passing = false;
  // Some surfaces or lights are hidden from some kinds of rays, or some surfaces are held out
  // (SurfaceInfo::hidden, holdout). Only the variants with `split` have this.
  bool visibility = false;
  // The radiance of each sample is split into the components of the light AOVs (path_records.h).
  bool split = false;
  // The integrator uses special sampling in media: it samples light at several points of each camera ray's
  // segment in a medium (segment_nee.h), or it samples directions that pass close to lamps, that is, to
  // lights without extent, and distances close to them (lamp_directions.h, equiangular.h).
  bool aimed = false;
  // Bidirectional path tracing: vertices of camera paths are connected to vertices of paths that start at a
  // directional emitter, the sun (light_vertices.h).
  bool connected = false;
  // The integrator is `whitted`: a path continues only after mirrors and clear glass. At the first other
  // surface it adds the direct light and ends.
  bool whitted = false;
  // Neighbouring pixels share the parts of their paths from the second vertex on (path_reuse.h).
  bool reuse = false;
  // Some medium has a phase function other than Henyey-Greenstein's (phase_function.h).
  bool phases = false;
  // The density of some medium falls with height, in closed form (height_fog.h).
  bool height = false;
  // Some shape moves while the shutter is open: rays have a time of the exposure.
  bool motion = false;
  bool operator==(const Features&) const = default;

  constexpr bool covers(const Features& need) const {
    return (media || !need.media) && (grids || !need.grids) && (chromatic || !need.chromatic) &&
           (emission || !need.emission) && (overlaps || !need.overlaps) && (passing || !need.passing) &&
           (aimed || !need.aimed) && (connected || !need.connected) && (whitted || !need.whitted) &&
           (reuse || !need.reuse) && (split || !need.split) && (visibility || !need.visibility) &&
           (phases || !need.phases) && (height || !need.height) && (motion || !need.motion);
  }
  constexpr Features with(bool Features::*feature) const {
    Features more = *this;
    more.*feature = true;
    return more;
  }
};
inline constexpr Features kEveryScene{
    .media = true, .grids = true, .chromatic = true, .emission = true, .overlaps = true, .passing = true};
// Everything that media may be
inline constexpr Features kAnyMedia = kEveryScene.with(&Features::phases).with(&Features::height);
inline constexpr Features kAnyMotion = kAnyMedia.with(&Features::motion);
inline constexpr Features kEverything = kAnyMotion.with(&Features::split).with(&Features::visibility);

}  // namespace ls::render
