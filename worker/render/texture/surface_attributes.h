// The data of surfaces that textures read: the uv and derivatives at a point, and mesh attributes, that is,
// colours or numbers that a mesh file gives for each vertex or each face.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

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
  UvPoint(V2 at) : uv(at) {}  // NOLINT: implicit, because most surfaces need only uv
  UvPoint(V2 at, V3 along_u, V3 along_v, const FacePoint* on = nullptr)
      : uv(at), du(along_u), dv(along_v), face(on) {}
  operator V2() const { return uv; }
  UvPoint seen_in(const Frame& frame) const { return {uv, frame.to_local(du), frame.to_local(dv), face}; }
};

// The mesh attributes, at vertices or faces, that `mesh_attribute` textures read, for each surface. They are
// filled in when meshes are loaded, and read only where such a texture is evaluated.
struct SurfaceAttributes {
  static constexpr std::uint32_t kNoChannel = 0xffffffffu;

  struct Channel {  // where in `values` one attribute of one mesh is stored
    bool per_face = false;
    // Index of the mesh's first vertex (first triangle if per_face) in the world's lists
    std::uint32_t base = 0;
    std::uint32_t count = 0;
    std::size_t first = 0;  // index in `values` of the mesh's first value
    // `name` is the attribute's number in `names`; `next` is the index of the next channel of the same
    // surface (kNoChannel: none)
    std::uint32_t name = 0, next = kNoChannel;
  };
  // The names of the attributes that the scene's textures read; the value is the attribute's number.
  std::map<std::string, std::uint32_t, std::less<>> names;
  std::vector<std::uint32_t> first_of;  // by surface: index of its first channel, or kNoChannel
  std::vector<Channel> channels;
  std::vector<C3> values;     // values of all attributes; a scalar is stored as three equal components
  std::vector<C3> means;      // by number in `names`: mean of the attribute over the values of all meshes
  std::uint64_t clamped = 0;  // number of negative values that were set to 0

  bool empty() const { return channels.empty(); }
  std::uint64_t bytes() const { return values.size() * sizeof(C3); }
  void find_means() {
    std::vector<V3d> sums(names.size(), V3d(0, 0, 0));
    std::vector<double> counts(names.size(), 0);
    for (std::uint32_t i : first_of)
      for (; i != kNoChannel; i = channels[i].next) {
        const Channel& c = channels[i];
        for (std::uint32_t k = 0; k < c.count; ++k) sums[c.name] += V3d(values[c.first + k]);
        counts[c.name] += c.count;
      }
    for (std::size_t i = 0; i < sums.size(); ++i)
      means.push_back(counts[i] > 0 ? C3(sums[i] / counts[i]) : C3(0));
  }
  // Returns the value of attribute number `name` (see `names`) at the point `at`; black if the surface has no
  // such attribute. `corners` contains three vertex indices per triangle.
  C3 value(std::uint32_t name, const FacePoint& at, std::span<const std::uint32_t> corners) const {
    std::uint32_t i = first_of[at.surface];
    while (i != kNoChannel && channels[i].name != name) i = channels[i].next;
    if (i == kNoChannel) return C3(0);
    const Channel& c = channels[i];
    if (c.per_face) return values[c.first + (at.triangle - c.base)];
    const std::uint32_t* v = &corners[std::size_t{3} * at.triangle];
    const C3 *first = &values[c.first], a = first[v[0] - c.base], b = first[v[1] - c.base],
             d = first[v[2] - c.base];
    return a * (1 - at.b1 - at.b2) + b * at.b1 + d * at.b2;
  }
};

}  // namespace ls::render
