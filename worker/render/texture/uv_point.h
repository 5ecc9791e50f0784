// The data of a point on a surface that textures use.
#pragma once

#include <cstdint>

#include "worker/render/math/math.h"

namespace ls::render {

// A point on a triangle, for reading mesh attributes. Its barycentric coordinates, the weights of the three
// corners, are 1 - b1 - b2, b1 and b2.
struct FacePoint {
  std::uint32_t surface = 0, triangle = 0;
  float b1 = 0, b2 = 0;
};

struct UvPoint {
  V2 uv;
  // The derivatives dp/du and dp/dv of the position p, in scene units, in the local shading frame. They are
  // set only if the surface's material needs them (SurfaceInfo::wants_slopes).
  V3 du{1, 0, 0}, dv{0, 1, 0};

  // The point on a triangle, for surfaces whose textures read mesh attributes
  // (SurfaceInfo::wants_attributes); else null. It must outlive this object.
  const FacePoint* face = nullptr;

  UvPoint(float u, float v) : uv(u, v) {}
  UvPoint(V2 at) : uv(at) {}  // NOLINT: most surfaces need only uv
  UvPoint(V2 at, V3 along_u, V3 along_v, const FacePoint* on = nullptr)
      : uv(at), du(along_u), dv(along_v), face(on) {}
  operator V2() const { return uv; }
  UvPoint seen_in(const Frame& frame) const { return {uv, frame.to_local(du), frame.to_local(dv), face}; }
};

}  // namespace ls::render
