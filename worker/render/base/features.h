// The features that a scene needs of the integrator. A variant is the integrator compiled for one set of
// features: it may leave code out, but it never changes the use of random numbers or the order of arithmetic.
// So all variants that have the features of a scene render it to the same bits
// (docs/decisions/0012-what-a-scene-needs.md).
#pragma once

#include "worker/render/base/built.h"

namespace ls::render {

struct Features {
  bool media = false;      // any participating medium
  bool grids = false;      // heterogeneous media
  bool chromatic = false;  // extinction that differs between channels
  bool emission = false;   // media that emit light
  // The scene has nested or intersecting media (medium_stack.h), or coincident surfaces of which one is null,
  // that is, index-matched (coincident.h).
  bool overlaps = false;
  // The scene has surfaces that light passes straight through: index-matched ones, masks, thin dielectrics.
  bool passing = false;
  bool split = false;  // light AOVs: each sample's radiance split into its components (light_components.h)
  // Light is sampled at several points of the camera's segments through media (camera_segment_nee.h), or
  // directions and flights also go near lamps (lamp_directions.h, lamp_flight.h).
  bool aimed = false;
  // Features that every variant has, unless the build leaves them out (built.h): index-matched surfaces, null
  // transmission, equi-angular sampling, lights that rays can hit, and the checks that count bad samples.
  bool boundaries = kBuilt.boundaries, null_transmission = kBuilt.null_transmission;
  bool equiangular = kBuilt.equiangular, found_lights = kBuilt.found_lights, health = kBuilt.health;
  bool operator==(const Features&) const = default;

  constexpr bool covers(const Features& need) const {
    return (media || !need.media) && (grids || !need.grids) && (chromatic || !need.chromatic) &&
           (emission || !need.emission) && (overlaps || !need.overlaps) && (passing || !need.passing) &&
           (aimed || !need.aimed) && (split || !need.split);
  }
};
inline constexpr Features kEveryScene{
    .media = true, .grids = true, .chromatic = true, .emission = true, .overlaps = true, .passing = true};
inline constexpr Features kEverything = [] {
  Features all = kEveryScene;
  all.split = true;
  return all;
}();

// The features compiled into this build.
inline constexpr Features kBuiltFeatures{.media = kBuilt.media,
                                         .grids = kBuilt.grids,
                                         .chromatic = kBuilt.chromatic,
                                         .emission = kBuilt.emission,
                                         .overlaps = kBuilt.overlaps,
                                         .passing = true,
                                         .split = true,
                                         .aimed = true};

}  // namespace ls::render
