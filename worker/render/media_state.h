// Which media there are where a path stands (docs/decisions/0010-media-boundaries.md).
//
// A boundary has an interior and an exterior medium, each of which may be none. Where boundaries are nested
// or cross each other, the media at a point are what the background has, plus the interior and less the
// exterior of every boundary that the point is inside of: in whatever order a path crosses them, it finds the
// same. Of these the media of the highest priority are in effect, together.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/render/geometry.h"
#include "worker/render/medium.h"

namespace ls::render {

// For scenes without overlaps: the medium of the side of the last boundary (Mitsuba's rule).
struct OneMedium {
  std::uint32_t medium = kNone;

  bool any() const { return medium != kNone; }
  static constexpr bool several() { return false; }
  std::uint32_t one() const { return medium; }
  void only(std::uint32_t m) { medium = m; }
};

class MediaState {
 public:
  // Boundaries that a path may be inside of at once. One more is an error of the sample, which is counted.
  static constexpr int kCapacity = 32;

  // Copied for every shadow ray: only what is in use.
  MediaState() = default;
  MediaState(const MediaState& o) { *this = o; }
  MediaState& operator=(const MediaState& o) {
    background_ = o.background_;
    bodies_ = o.bodies_;
    count_ = o.count_;
    overflowed_ = o.overflowed_;
    std::copy_n(o.body_.begin(), bodies_, body_.begin());
    std::copy_n(o.effect_.begin(), count_, effect_.begin());
    return *this;
  }

  bool any() const { return count_ > 0; }
  bool several() const { return count_ > 1; }
  std::uint32_t one() const { return effect_[0]; }
  // In effect, in ascending order; one that is there twice stands there twice.
  std::span<const std::uint32_t> all() const { return {effect_.data(), static_cast<std::size_t>(count_)}; }
  bool overflowed() const { return overflowed_; }

  // Where there are no overlaps.
  void only(std::uint32_t m) {
    effect_[0] = m;
    count_ = m != kNone;
  }
  // Inside of nothing.
  void start(std::uint32_t background, const std::vector<Medium>& media);
  // On this side of the boundary; `through`: coming from the other one.
  void stand(const SurfaceInfo& s, bool outside, bool through, const std::vector<Medium>& media);

 private:
  struct Body {
    std::uint32_t interior, exterior;
    bool operator==(const Body&) const = default;
  };
  void enter(const Body& b, bool sheet);
  void leave(const Body& b, bool through);
  int count_of(std::uint32_t medium) const;
  void settle(const std::vector<Medium>& media);

  std::uint32_t background_ = kNone;
  int bodies_ = 0, count_ = 0;
  bool overflowed_ = false;
  std::array<Body, kCapacity> body_;
  std::array<std::uint32_t, kCapacity + 1> effect_;
};

}  // namespace ls::render
