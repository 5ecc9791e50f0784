// A place on a surface as textures see it, and what moving about in (u, v) does there.
#pragma once

#include "worker/render/math.h"

namespace ls::render {

struct UvPoint {
  V2 uv;
  // dp/du and dp/dv in scene units, in the local shading frame. Filled in only where something on the surface
  // asks for them (SurfaceInfo::wants_slopes).
  V3 du{1, 0, 0}, dv{0, 1, 0};

  UvPoint(float u, float v) : uv(u, v) {}
  UvPoint(V2 at) : uv(at) {}  // NOLINT: most surfaces are places alone
  UvPoint(V2 at, V3 along_u, V3 along_v) : uv(at), du(along_u), dv(along_v) {}
  operator V2() const { return uv; }
  UvPoint seen_in(const Frame& frame) const { return {uv, frame.to_local(du), frame.to_local(dv)}; }
};

}  // namespace ls::render
