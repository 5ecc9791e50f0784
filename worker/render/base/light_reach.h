// The receivers and the blockers of a light: the surfaces and media that receive its light, and the surfaces
// that shade it.
#pragma once

#include "core/scene/schema/light_links.h"
#include "worker/render/base/ray_kind.h"

namespace ls::render {

struct LightReach {
  RayKinds hidden;  // whether surfaces, or media, do not receive the light
  // The lists of link sets (light_links.h) of the receivers and of the blockers
  scene::LinkIndex receivers = scene::kEverything, blockers = scene::kEverything;

  // True if its shadow rays may pass surfaces that are no blockers.
  constexpr bool has_blockers() const { return blockers != scene::kEverything; }
  // True if a surface or a medium, which scatters rays of this kind and which these lists have, receives the
  // light.
  constexpr bool lights(RayKind kind, scene::LinkMask links) const {
    return !hidden.has(kind) && scene::linked(receivers, links);
  }
};

}  // namespace ls::render
