// The path tracers with Features::connected. They take long to compile, so they have their own source file.
#include "worker/render/integrator/camera_segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {
namespace {

constexpr Features kAll{.media = true, .grids = true, .passing = true, .aimed = true, .connected = true};
constexpr Features kConnectedAndSplit = [] {
  Features all = kAll;
  all.split = true;
  return all;
}();

}  // namespace

std::span<const Variant> connected_variants() {
  static constexpr Variant kVariants[] = {
      variant<Features{.passing = true, .connected = true}>("surfaces, connected"),
      variant<Features{.media = true, .grids = true, .passing = true, .connected = true}>(
          "grey media, connected"),
      variant<kAll, CameraSegmentNee>("grey media, aimed and connected"),
  };
  return kVariants;
}

const Variant kConnectedSplitVariant =
    variant<kConnectedAndSplit, CameraSegmentNee>("grey media, aimed and connected, and light in parts");

}  // namespace ls::render
