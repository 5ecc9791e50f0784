// What receives the light of a light, and what shades it.
#pragma once

#include "core/scene/schema/light_links.h"
#include "worker/render/base/ray_kind.h"

namespace ls::render {

struct LightReach {
  RayKinds hidden;  // what receives no light: surfaces, media
  // The lists of link sets (light_links.h) of what receives the light, and of the surfaces that shade it.
  scene::LinkIndex receivers = scene::kEverything, blockers = scene::kEverything;

  // True if its shadow rays do not meet all surfaces.
  constexpr bool has_blockers() const { return blockers != scene::kEverything; }
  // True if a surface or a medium, which scatters rays of this kind and which these lists have, receives the
  // light.
  constexpr bool lights(RayKind kind, scene::LinkMask links) const {
    return !hidden.has(kind) && scene::linked(receivers, links);
  }
};

}  // namespace ls::render
