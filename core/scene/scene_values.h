// The basic value types of a scene; see scene.h.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/base/digest.h"

namespace ls {

using Rgb = std::array<double, 3>;
inline bool all_zero(const Rgb& c) { return c == Rgb{0, 0, 0}; }
inline bool is_grey(const Rgb& c) { return c[0] == c[1] && c[1] == c[2]; }
// A point or direction. It is a type of its own, although Rgb has three numbers, too, so that readers and
// writers of files can tell points from colours, which files write in different ways.
struct Vec3 : std::array<double, 3> {};

// A row-major 4 x 4 matrix for column vectors: p' = M p. It is the identity by default.
struct Transform {
  std::array<double, 16> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  bool operator==(const Transform&) const = default;
};
inline Vec3 origin_of(const Transform& t) { return {t.m[3], t.m[7], t.m[11]}; }
// A row-major 3 x 3 matrix that acts on (u, v, 1).
struct UvTransform {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
  bool operator==(const UvTransform&) const = default;
};

template <class Tag>
struct Index {
  std::uint32_t value = 0;
  auto operator<=>(const Index&) const = default;
};
using AssetIndex = Index<struct AssetTag>;
using TextureIndex = Index<struct TextureTag>;
using BsdfIndex = Index<struct BsdfTag>;
using VolumeIndex = Index<struct VolumeTag>;
using PhaseIndex = Index<struct PhaseTag>;
using MediumIndex = Index<struct MediumTag>;
using GroupIndex = Index<struct GroupTag>;
using MeterIndex = Index<struct MeterTag>;

// A file that the scene uses. `name` is the file's name as the scene file gives it, for messages; the digest
// identifies the file's bytes.
struct Asset {
  std::string name;
  Digest digest;
  std::uint64_t bytes = 0;
  bool operator==(const Asset&) const = default;
};

}  // namespace ls
