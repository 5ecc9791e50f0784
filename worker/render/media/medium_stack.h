// The media at a path's current position (docs/decisions/0010-media-boundaries.md).
//
// A boundary is a surface with an interior and an exterior medium, either of which may be none. The media at
// a point follow from a count for each medium: the background medium counts once, and each boundary that
// encloses the point adds 1 to the count of its interior medium and subtracts 1 from that of its exterior
// medium. The media with a count above 0 are present at the point. So they do not depend on the order in
// which a path crosses boundaries. Only the present media of the highest priority are in effect; if there are
// several, they overlap.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/render/geometry/geometry.h"
#include "worker/render/media/medium.h"

namespace ls::render {

// Used in place of MediaState in scenes whose media do not overlap. It holds a single medium: of the two
// media of the boundary crossed last, the one on the path's side (Mitsuba's rule).
struct OneMedium {
  std::uint32_t medium = kNone;

  bool any() const { return medium != kNone; }
  static constexpr bool several() { return false; }
  std::uint32_t one() const { return medium; }
  void only(std::uint32_t m) { medium = m; }
  int count(std::uint32_t m) const { return medium == m; }  // as of MediaState
};

class MediaState {
 public:
  // The largest number of boundaries that a path may be inside of at the same time. If it enters one more,
  // its sample is rejected and counted (HealthCause::nested_media).
  static constexpr int kCapacity = 32;

  // The copy operations copy only the used parts of the arrays, to save time: the state is copied for every
  // shadow ray.
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
  // The indices of the media in effect, in ascending order. A medium whose count is 2 is listed twice, and so
  // on.
  std::span<const std::uint32_t> all() const { return {effect_.data(), static_cast<std::size_t>(count_)}; }
  // How often all() lists the medium m.
  int count(std::uint32_t m) const { return static_cast<int>(std::ranges::count(all(), m)); }
  bool overflowed() const { return overflowed_; }

  // Makes m the only medium (none if m is kNone); for scenes without overlaps.
  void only(std::uint32_t m) {
    effect_[0] = m;
    count_ = m != kNone;
  }
  // Sets the state of a path that starts outside of all boundaries, in the medium `background`.
  void start(std::uint32_t background, const std::vector<Medium>& media);
  // Updates the state of a path that has met the boundary s and is now outside of it (if `outside`) or inside
  // of it. `through` is true if the path crossed s, that is, was on the other side before.
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
