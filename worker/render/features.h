// What a scene needs of the integrator. A variant may remove code, never change random-number use or
// arithmetic order, so every variant that covers a scene gives the same bits (DESIGN section 6).
#pragma once

namespace ls::render {

struct Features {
  bool media = false;      // any participating medium
  bool grids = false;      // heterogeneous media
  bool chromatic = false;  // extinction that differs between channels
  bool emission = false;   // media that give off light
  bool overlaps = false;   // media within or across each other (media_state.h), surfaces on each other, one
                           // of them null (coincident.h)
  bool passing = false;    // surfaces that light passes straight on: index-matched ones, masks, thin sheets
  bool split = false;      // AOVs of light: each sample's radiance in its parts (light_split.h)
  bool operator==(const Features&) const = default;

  constexpr bool covers(const Features& need) const {
    return (media || !need.media) && (grids || !need.grids) && (chromatic || !need.chromatic) &&
           (emission || !need.emission) && (overlaps || !need.overlaps) && (passing || !need.passing) &&
           (split || !need.split);
  }
};
inline constexpr Features kEveryScene{
    .media = true, .grids = true, .chromatic = true, .emission = true, .overlaps = true, .passing = true};
inline constexpr Features kEverything = [] {
  Features all = kEveryScene;
  all.split = true;
  return all;
}();

}  // namespace ls::render
