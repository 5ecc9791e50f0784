#include "worker/render/media/medium_stack.h"

namespace ls::render {

void MediaState::start(std::uint32_t background, const std::vector<Medium>& media) {
  *this = {};
  background_ = background;
  settle(media);
}

void MediaState::stand(const SurfaceInfo& s, bool outside, bool through, const std::vector<Medium>& media) {
  if (!s.transition) return;
  const Body b{s.interior, s.exterior};
  if (outside)
    leave(b, through);
  else if (through || std::find(body_.begin(), body_.begin() + bodies_, b) == body_.begin() + bodies_)
    enter(b, s.sheet);
  settle(media);
}

// Called when the path enters a boundary: adds it to the boundaries that the path is inside of. A sheet is a
// surface that is not closed: it encloses a volume only together with others, or none at all. A path may have
// come around the edge of a sheet and be inside already; then nothing is added.
void MediaState::enter(const Body& b, bool sheet) {
  if (sheet && std::find(body_.begin(), body_.begin() + bodies_, b) != body_.begin() + bodies_) return;
  if (bodies_ == kCapacity) {
    overflowed_ = true;
    return;
  }
  body_[static_cast<std::size_t>(bodies_++)] = b;
}

// Called when the path leaves a boundary or, if `through` is false, touches it from outside. A path that
// leaves removes the boundary from those that it is inside of. If it is not among them, the path began inside
// it, so that its interior was counted as the background medium. The boundary's exterior then becomes the
// background.
//
// The exterior also becomes the background in two other cases: if the path entered the boundary while no
// background was known, and if the path only touches the boundary and is in no medium. But it never does if
// other boundaries around the path already account for the exterior.
void MediaState::leave(const Body& b, bool through) {
  const auto end = body_.begin() + bodies_;
  bool known = false;
  if (const auto it = std::find(body_.begin(), end, b); through && it != end) {
    *it = body_[static_cast<std::size_t>(--bodies_)];
    known = background_ != kNone;
  } else if (through && b.interior != kNone && background_ == b.interior) {
    background_ = b.exterior;
  }
  if (!known && b.exterior != kNone && count_of(b.exterior) <= 0 && (through || count_ == 0))
    background_ = b.exterior;
}

int MediaState::count_of(std::uint32_t medium) const {
  int n = background_ == medium;
  for (int i = 0; i < bodies_; ++i) {
    const Body& b = body_[static_cast<std::size_t>(i)];
    n += (b.interior == medium) - (b.exterior == medium);
  }
  return n;
}

void MediaState::settle(const std::vector<Medium>& media) {
  count_ = 0;
  const auto consider = [&](std::uint32_t m) {
    const auto seen = effect_.begin() + count_;
    if (m == kNone || std::find(effect_.begin(), seen, m) != seen) return;
    const int n = count_of(m);
    if (n <= 0) return;
    if (count_ > 0 && media[m].priority != media[one()].priority) {
      if (media[m].priority < media[one()].priority) return;
      count_ = 0;
    }
    for (int i = 0; i < n; ++i) effect_[static_cast<std::size_t>(count_++)] = m;
  };
  consider(background_);
  for (int i = 0; i < bodies_; ++i) consider(body_[static_cast<std::size_t>(i)].interior);
  std::sort(effect_.begin(), effect_.begin() + count_);
}

}  // namespace ls::render
