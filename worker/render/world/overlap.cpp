#include "worker/render/world/overlap.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "worker/render/geometry/surface_boxes.h"
#include "worker/render/world/near_plane.h"

namespace ls::render {
namespace {

// The largest number of pairs of boxes that any_touch() examines. It sorts the boxes by their start along x
// and examines the pairs that overlap along x until it finds a pair that touches. This takes O(n log n) time
// for n boxes unless many overlap along x. After kMaxBoxPairs pairs it stops and returns true, as if a pair
// touched.
constexpr std::size_t kMaxBoxPairs = std::size_t{1} << 24;

bool any_touch(std::vector<SurfaceBox> boxes) {
  std::sort(boxes.begin(), boxes.end(),
            [](const SurfaceBox& a, const SurfaceBox& b) { return a.lo.x < b.lo.x; });
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t k = i + 1; k < boxes.size() && boxes[k].lo.x <= boxes[i].hi.x; ++k) {
      if (boxes[i].touches(boxes[k]) || ++pairs > kMaxBoxPairs) return true;
    }
  }
  return false;
}

// True if some boundary has the medium `ambience` on neither side. Such a boundary may lie inside that
// medium, and then the two media overlap.
bool stands_in_ambience(const Geometry& g, std::uint32_t ambience) {
  if (ambience == kNone) return false;
  return std::any_of(g.surfaces.begin(), g.surfaces.end(), [&](const SurfaceInfo& s) {
    return s.transition && s.crossed && s.exterior != ambience && s.interior != ambience;
  });
}

constexpr int kMaxCrossings = 1 << 12;  // largest number of surfaces that a ray of camera_media() crosses

// Counts, for each boundary, the rays that leave it without having entered it: the boundary then encloses the
// ray's origin. The key is the surface and the instance of the boundary. note_left() adds one ray.
using Left = std::map<std::pair<std::uint32_t, std::uint32_t>, int>;
void note_left(const World& w, V3 o, const V3& d, Left& left) {
  std::set<Left::key_type> seen;
  for (int i = 0; i < kMaxCrossings; ++i) {
    const auto primitive = w.accel.nearest(o, d, kInfinity);
    SurfaceHit hit;
    if (!primitive || !w.geometry.complete(*primitive, o, d, hit)) return;
    const SurfaceInfo& s = w.geometry.surfaces[hit.surface];
    const std::pair key{hit.surface, hit.primitive.instance};
    if (s.transition && !s.sheet && seen.insert(key).second && dot(d, hit.ng) > 0) ++left[key];
    o = offset_point(hit, d);
  }
}
// The directions avoid axes and diagonals, along which hits are often grazing.
Left left_from(const World& w, const V3& o) {
  Left left;
  for (const V3d& d : {V3d(.31, .82, .48), V3d(-.72, .24, .65), V3d(.17, -.44, -.88)})
    note_left(w, o, V3(d.normalized()), left);
  return left;
}

}  // namespace

bool media_may_overlap(const World& w) {
  const Geometry& g = w.geometry;
  std::set<std::uint32_t> ambiences{w.camera_medium};
  for (const MeterStart& m : w.meters.starts()) ambiences.insert(m.ambience);
  for (const SurfaceInfo& s : g.surfaces)
    if (s.transition) ambiences.insert(s.exterior);
  for (const std::uint32_t m : ambiences)
    if (stands_in_ambience(g, m)) return true;
  auto boxes = surface_boxes(g, [](const SurfaceInfo& s) { return s.transition && s.crossed; });
  return !boxes || any_touch(std::move(*boxes));
}

namespace {

bool is_around(const Left::value_type& entry) { return entry.second >= 2; }

bool holds_medium(const World& w, const Left& left, std::uint32_t medium) {
  return std::any_of(left.begin(), left.end(), [&](const auto& e) {
    return is_around(e) && w.geometry.surfaces[e.first.first].interior == medium;
  });
}

// Returns `ambience` and the interiors of the boundaries that rays left.
MediaState within(const World& w, const Left& left, std::uint32_t ambience) {
  MediaState state;
  state.start(ambience, w.media);
  for (const auto& e : left)
    if (is_around(e)) state.stand(w.geometry.surfaces[e.first.first], false, true, w.media);
  return state;
}

}  // namespace

MediaState media_at(const World& w, const V3& p, std::uint32_t ambience) {
  const Left left = left_from(w, p);
  return within(w, left, holds_medium(w, left, ambience) ? kNone : ambience);
}

void place_meters(World& w) {
  const bool bounded = std::ranges::any_of(w.geometry.surfaces, &SurfaceInfo::transition);
  for (MeterStart& m : w.meters.starts()) {
    if (m.shape == kNone || !bounded)
      m.media = media_at(w, offset_point(m.p, m.d, m.reach, m.d), m.ambience);
    else if (const SurfaceInfo& s = w.geometry.surfaces[w.meters.shape(m).surface()];
             s.transition && !w.overlaps)
      m.media.emplace().only(s.exterior);
  }
}

MediaState camera_media(const World& w) {
  if (w.camera_medium == kNone) return {};
  // At the time at which accel and geometry show what moves, unless they are given another one. No boundary
  // that moves passes the camera (check_way_of_camera), so the media are those of all times.
  const double x = w.origin_x + w.size.width / 2., y = w.origin_y + w.size.height / 2.;
  const CameraRay ray =
      w.camera.moves() ? w.camera.ray_at(0, x, y, {.5f, .5f}) : w.camera.ray(x, y, {.5f, .5f});
  const V3 eye = w.hidden_boundaries ? hidden_part(w, ray).start : ray.o;
  const Left left = left_from(w, eye);
  // A camera on the face of a body, or just before it, names the medium in it too: rays enter the body before
  // the near plane, and this crossing adds the medium (for_hidden_boundaries).
  const bool inside_of_it = holds_medium(w, left, w.camera_medium) ||
                            (w.hidden_boundaries && holds_medium(w, left_from(w, ray.o), w.camera_medium));
  return within(w, left, inside_of_it ? kNone : w.camera_medium);
}

}  // namespace ls::render
