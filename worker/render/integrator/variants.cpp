// The variants of the path tracer for the integrator `whitted`, and the variants with Features::aimed or
// Features::connected.
#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

std::span<const Variant> whitted_variants() {
  // Features::overlaps is for scenes with coincident surfaces: a ray that hits one of them tests all of them.
  static constexpr Variant kVariants[] = {
      variant<Features{.passing = true, .whitted = true}>("surfaces, whitted"),
      variant<Features{.overlaps = true, .passing = true, .whitted = true}>("coincident surfaces, whitted"),
      variant<Features{.overlaps = true,
                       .passing = true,
                       .visibility = true,
                       .split = true,
                       .whitted = true,
                       .motion = true}>("coincident surfaces that move, whitted, and light in parts"),
  };
  return kVariants;
}

std::span<const Variant> aimed_variants() {
  static const Variant kVariants[] = {
      variant<Features{.media = true, .passing = true, .aimed = true}, CameraSegmentNee>(
          "homogeneous grey media, aimed"),
      variant<Features{.media = true, .grids = true, .passing = true, .aimed = true}, CameraSegmentNee>(
          "grey grids, aimed"),
      variant<kEveryScene.with(&Features::aimed), CameraSegmentNee>("everything, aimed"),
      variant<kEveryScene.with(&Features::aimed).with(&Features::phases), CameraSegmentNee>(
          "everything, aimed, any phase function"),
      variant<Features{.media = true, .passing = true, .aimed = true, .height = true}, CameraSegmentNee>(
          "grey fog that falls with height, aimed"),
      variant<kAnyMedia.with(&Features::aimed), CameraSegmentNee>(
          "everything, aimed, fog that falls with height"),
      kAimedSplitVariant,
  };
  return kVariants;
}

std::span<const Variant> connected_variants() {
  static constexpr Features kAll{
      .media = true, .grids = true, .passing = true, .aimed = true, .connected = true};
  static constexpr Variant kVariants[] = {
      variant<Features{.passing = true, .connected = true}>("surfaces, connected"),
      variant<Features{.media = true, .grids = true, .passing = true, .connected = true}>(
          "grey media, connected"),
      variant<kAll, CameraSegmentNee>("grey media, aimed and connected"),
      variant<kAll.with(&Features::phases), CameraSegmentNee>(
          "grey media, aimed and connected, any phase function"),
      variant<kAll.with(&Features::phases).with(&Features::height), CameraSegmentNee>(
          "grey media, aimed and connected, fog that falls with height"),
      variant<kAll.with(&Features::phases).with(&Features::height).with(&Features::split), CameraSegmentNee>(
          "grey media, aimed and connected, and light in parts"),
  };
  return kVariants;
}

}  // namespace ls::render
