// The path tracers with Features::reuse, and which worlds use them. They take long to compile, so they have
// their own source file.
#include "worker/render/integrator/sharing_block.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {
namespace {

constexpr Features kAllSplit{.media = true, .chromatic = true, .passing = true, .split = true, .reuse = true};

}  // namespace

std::span<const Variant> reuse_variants() {
  static constexpr Variant kVariants[] = {
      group_variant<Features{.passing = true, .reuse = true}>("surfaces, tails shared"),
      group_variant<Features{.media = true, .passing = true, .reuse = true}>(
          "homogeneous grey media, tails shared"),
      group_variant<Features{.media = true, .chromatic = true, .passing = true, .reuse = true}>(
          "homogeneous chromatic media, tails shared"),
  };
  return kVariants;
}

const Variant kReuseSplitVariant =
    group_variant<kAllSplit>("homogeneous media, tails shared, and light in parts");

void share_tails(const IntegratorSettings& settings, World& w) {
  Features need = w.need;
  need.split = false;
  need.reuse = true;
  // Grids have no density of flights in closed form; lamps in media, light vertices and points on segments
  // change how directions are sampled; lights without a position are weighted one by one where rays end.
  if (settings.path_reuse < 2 || !reuse_variants().back().covers.covers(need)) return;
  if (w.lights.any_without_place() || w.null_transmission || !w.depth_allows(2)) return;
  // Roulette at the first vertex would be a part of the densities
  if (w.rr_depth < 2 || (w.passing_counts && w.need.passing)) return;
  for (const SurfaceInfo& s : w.geometry.surfaces)
    // Rays from two sides may find different media behind an open boundary. A null surface that emits light
    // is one of several such on a path.
    if ((s.transition && s.sheet) || (s.null && s.light != kNone)) return;
  w.reuse = settings.path_reuse;
  w.need.reuse = true;
}

}  // namespace ls::render
