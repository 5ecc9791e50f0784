// The variants of the path tracer: each is the path tracer compiled for one set of features (features.h) and
// one integrator. A scene is rendered with a variant that has all features that the scene needs. Light
// components are the parts of a sample's radiance that were scattered in different ways (LightSplit).
#pragma once

#include <algorithm>
#include <array>
#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <span>
#include <utility>

#include "worker/render/base/features.h"
#include "worker/render/integrator/path_tracer.h"
#include "worker/render/math/random.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Renders one sample of a pixel. The parameters are the world, the pixel's x and y in the image, the sample's
// index, the light components to which the sample's radiance is added (used only with Features::split), and
// the light vertices to which paths are connected (used only with Features::connected).
using SampleFn = SampleOutcome (*)(const World&, int, int, std::uint64_t, LightSplit*, Connections);

// Renders sample number `sample` of several pixels, at most kMostTogether. These are divided into groups of
// World::reuse pixels; in a group each path also uses the light that the other paths found. `splits` has the
// light components of each pixel, or is empty if they are not wanted.
inline constexpr std::size_t kMostTogether = 256;
struct PixelAt {
  int x, y;
};
using GroupFn = void (*)(const World&, std::span<const PixelAt>, std::uint64_t sample,
                         std::span<LightSplit> splits, std::span<SampleOutcome> outcomes);
struct Variant {
  Features covers;
  const char* name;
  SampleFn sample;
  GroupFn group = nullptr;  // set with Features::reuse, and then used instead of `sample`
};

[[gnu::cold, gnu::noinline]] inline CameraRay camera_ray_in_time(const World& w, const SampleStream& stream,
                                                                 double fx, double fy, V2 lens) {
  return w.camera.ray_at(stream.group(0, Purpose::time).u(0), fx, fy, lens);
}
// Returns the camera ray through a point of the frame, in pixels. If anything moves, the time is random.
inline CameraRay camera_ray_through(const World& w, const SampleStream& stream, double fx, double fy,
                                    V2 lens) {
  if (w.moves) [[unlikely]]
    return camera_ray_in_time(w, stream, fx, fy, lens);
  return w.camera.ray(fx, fy, lens);
}
inline CameraRay camera_ray(const World& w, const SampleStream& stream, int x, int y) {
  const Group g = stream.group(0, Purpose::camera);
  const double fx = x + .5 + w.filter.offset(g.u(0)), fy = y + .5 + w.filter.offset(g.u(1));
  return camera_ray_through(w, stream, fx, fy, {g.u(2), g.u(3)});
}
template <Features F, template <Features> class Light>
SampleOutcome sample_with(const World& w, int x, int y, std::uint64_t sample, LightSplit* split,
                          Connections connections) {
  x += w.origin_x;
  y += w.origin_y;
  const SampleStream stream(w.seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), sample);
  return PathTracer<F, Light>(w, stream, split, connections).trace(camera_ray(w, stream, x, y));
}

template <Features F, template <Features> class Light = VertexNee>
constexpr Variant variant(const char* name) {
  return {F, name, &sample_with<F, Light>};
}

template <Features F>
void group_with(const World& w, std::span<const PixelAt> pixels, std::uint64_t sample,
                std::span<LightSplit> splits, std::span<SampleOutcome> outcomes) {
  // These are static vectors and not arrays of std::optional, because the compiler would clear all bytes of
  // such arrays at each call.
  boost::container::static_vector<PathTracer<F>, kMostTogether> paths;
  boost::container::static_vector<PathTracer<F>*, kMostTogether> sorted;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const int x = pixels[i].x + w.origin_x, y = pixels[i].y + w.origin_y;
    const SampleStream stream(w.seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), sample);
    paths.emplace_back(w, stream, splits.empty() ? nullptr : &splits[i]);
    (void)paths.back().trace(camera_ray(w, stream, x, y));
    sorted.push_back(&paths.back());
  }
  PathTracer<F>::sort_to_share(sorted);
  const auto group = static_cast<std::size_t>(w.reuse);
  for (std::size_t i = 0; i < sorted.size(); i += group)
    PathTracer<F>::share({sorted.data() + i, std::min(group, sorted.size() - i)});
  for (std::size_t i = 0; i < pixels.size(); ++i) outcomes[i] = paths[i].outcome();
}
template <Features F>
constexpr Variant group_variant(const char* name) {
  return {F, name, nullptr, &group_with<F>};
}

// A block of pixels whose paths share their tails, that is, the parts from the second vertex on
// (path_reuse.h). The full frame is cut into squares, the blocks. For each sample the pixels of a block are
// put in random order and then divided into groups, and the pixels of a group share. So two pixels are rarely
// in the same group, and their errors are nearly independent. Blocks begin at the corner of the full frame
// and do not depend on tiles, so a pixel has the same value in a tile, in a crop and in the whole image.
class SharingBlock {
 public:
  static constexpr int kSide = 16;  // pixels
  static_assert(kSide * kSide <= kMostTogether);

  // Makes the block that contains this pixel, which is given by its place in the image (a crop of the full
  // frame, or all of it).
  SharingBlock(const World& w, PixelAt pixel) : w_(w) {
    row_ = (pixel.y + w.origin_y) / kSide;
    column_ = (pixel.x + w.origin_x) / kSide;
    width_ = std::min(kSide, w.frame.width - column_ * kSide);
    height_ = std::min(kSide, w.frame.height - row_ * kSide);
  }
  int row() const { return row_; }
  int column() const { return column_; }
  std::size_t pixels() const { return static_cast<std::size_t>(width_ * height_); }
  std::size_t index(PixelAt p) const {
    return static_cast<std::size_t>((p.y + w_.origin_y - row_ * kSide) * width_ + p.x + w_.origin_x -
                                    column_ * kSide);
  }
  using Pixels = boost::container::static_vector<PixelAt, kMostTogether>;
  // Returns the pixels of the block in a random order, which depends on the sample's index. If the image is a
  // crop, some of the pixels may lie outside of it.
  Pixels in_order_of(std::uint64_t sample) const {
    Pixels order;
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        order.push_back({column_ * kSide + x - w_.origin_x, row_ * kSide + y - w_.origin_y});
    const auto corner = (static_cast<std::uint64_t>(row_) << 32) | static_cast<std::uint64_t>(column_);
    RandomStream dice(combine(combine(combine(w_.seed, kDealing), corner), sample));
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[dice.next() % i]);
    return order;
  }

 private:
  // Keeps the random numbers that order a block's pixels apart from other random numbers of the same seed.
  static constexpr std::uint64_t kDealing = 0x6465'616c;

  const World& w_;
  int row_, column_, width_, height_;
};

// Each function returns the variants of an integrator, cheapest first. The last variant of each list has all
// features that the list supports, and also computes light components (Features::split).
std::span<const Variant> distant_variants();  // of `volpath_distant_mis`
std::span<const Variant> whitted_variants();  // of `whitted`, which ignores media
// The variants of `volpath` and `path` with Features::aimed.
std::span<const Variant> aimed_variants();
// The variants with Features::connected. They support only grey media that neither overlap nor emit light.
std::span<const Variant> connected_variants();
// The variants with Features::reuse. They support only homogeneous media that neither overlap nor emit light.
std::span<const Variant> reuse_variants();

// The last variants of three lists: those of `volpath`, of aimed_variants() and of distant_variants(). They
// are defined in source files of their own, because in a file that contains one of them the compiler inlines
// less into the other variants.
extern const Variant kSplitVariant, kAimedSplitVariant, kDistantSplitVariant;

}  // namespace ls::render
