// The edges of the slices of a deep image (integrator/deep_edges.h), kept from one round of a tile to the
// next.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <unordered_map>
#include <vector>

namespace ls::render {

// The depths of surfaces that share a slice.
struct SurfaceRange {
  float begin, end;
};

// The slices of a pixel, as depths in the world's units, ascending.
struct DeepEdges {
  // What the image states: one number more than there are slices. That of a slice of surfaces is negative,
  // and its magnitude is the depth of the surfaces, not that at which the slice begins.
  std::vector<float> stated;
  std::vector<float> between;          // the ends of all slices but the last
  std::vector<SurfaceRange> surfaces;  // the slices of surfaces
};

// Edges are a function of the world and the pixel, and cost many rays. Those of the first pixels that are
// asked for are kept; the memory is bounded. Several threads may use it at once.
class DeepEdgesCache {
 public:
  template <class Make>
  DeepEdges get(int x, int y, const Make& make) {
    Shard& shard = shards_[static_cast<std::uint32_t>(y) % kShards];
    const std::uint64_t key =
        std::uint64_t{static_cast<std::uint32_t>(y)} << 32 | static_cast<std::uint32_t>(x);
    {
      const std::lock_guard lock(shard.mutex);
      if (const auto found = shard.known.find(key); found != shard.known.end())
        return unpacked(found->second);
    }
    DeepEdges edges = make();
    Packed packed = pack(edges);
    const std::size_t bytes = sizeof(Packed) + kOverhead + packed.edges.stated.size() * sizeof(float) +
                              packed.edges.between.size() * sizeof(float) +
                              packed.edges.surfaces.size() * sizeof(SurfaceRange);
    const std::lock_guard lock(shard.mutex);
    if (shard.bytes + bytes <= kMostBytes / kShards && shard.known.emplace(key, std::move(packed)).second)
      shard.bytes += bytes;
    return edges;
  }

 private:
  static constexpr std::size_t kMostBytes = std::size_t{64} << 20, kShards = 64;
  static constexpr std::size_t kOverhead = 96;  // of an element of a map and of three allocations, about

  // Edges without the equal numbers at the end, which most pixels have
  struct Packed {
    DeepEdges edges;
    std::size_t stated = 0, between = 0;  // the sizes that they had
  };
  static Packed pack(const DeepEdges& edges) {
    Packed packed{{shortened(edges.stated), shortened(edges.between), edges.surfaces},
                  edges.stated.size(),
                  edges.between.size()};
    return packed;
  }
  static std::vector<float> shortened(const std::vector<float>& all) {
    std::size_t n = all.size();
    while (n > 1 && all[n - 1] == all[n - 2]) --n;
    return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(n)};
  }
  static DeepEdges unpacked(const Packed& packed) {
    DeepEdges edges = packed.edges;
    if (!edges.stated.empty()) edges.stated.resize(packed.stated, edges.stated.back());
    if (!edges.between.empty()) edges.between.resize(packed.between, edges.between.back());
    return edges;
  }

  struct Shard {
    std::mutex mutex;
    std::unordered_map<std::uint64_t, Packed> known;
    std::size_t bytes = 0;
  };
  std::array<Shard, kShards> shards_;
};

}  // namespace ls::render
