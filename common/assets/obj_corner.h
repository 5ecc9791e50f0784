// A corner of a face of an OBJ file, and a hash of it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ls {

// A corner of a face: the indices of its position (v), uv (vt) and normal (vn), counted from 0. -1 means
// none.
struct Corner {
  std::int64_t v = -1, vt = -1, vn = -1;
  bool operator==(const Corner&) const = default;
};

// The hash is keyed by a secret, so that a file cannot contain corners that were chosen to collide. The
// resulting mesh does not depend on the secret: vertices are numbered in order of appearance.
struct CornerHash {
  std::uint64_t secret = 0;

  std::size_t operator()(const Corner& c) const {
    std::uint64_t h = (static_cast<std::uint64_t>(c.v) ^ secret) * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 29) ^ static_cast<std::uint64_t>(c.vt)) * 0xbf58476d1ce4e5b9u + secret;
    h = (h ^ (h >> 32) ^ static_cast<std::uint64_t>(c.vn)) * 0x94d049bb133111ebu;
    return h ^ (h >> 31);
  }
};

}  // namespace ls
