#include "worker/render/lights/portals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "worker/render/math/random.h"

namespace ls::render {
namespace {

// A face of the box gets a portal if more than this share of the sky's light leaves through it.
constexpr double kLeastLight = .02;
// A plane must have more than this share of its face's light pass through it. Light that was found between
// the plane and the face does not.
constexpr double kLeastThrough = .9;
// The planes that are tried for a face, from the face to the middle of the box
constexpr int kPlanes = 32;
// A plane is divided into kCells x kCells cells to tell how close together the rays are on it. They cover
// twice the face's width and height; rays farther out count for the outermost cells.
constexpr int kCells = 128;
constexpr std::size_t kSide = 16;      // cells across and down a portal's rectangle
constexpr float kLeastMargin = 1e-4f;  // margin of a portal's rectangle, as a share of the box's size

}  // namespace

struct Portals::Box {
  V3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};

  explicit Box(std::span<const Found> found) {
    for (const Found& f : found) {
      for (int k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], f.p[k]);
        high[k] = std::max(high[k], f.p[k]);
      }
    }
  }
  float side(int axis) const { return high[axis] - low[axis]; }
  // The face through which a ray from inside leaves: 2 axis + (1 if it is the one where p[axis] is larger)
  int face_of(const Found& f) const {
    int face = 0;
    float nearest = kInfinity;
    for (int k = 0; k < 3; ++k) {
      const float t = ((f.d[k] > 0 ? high[k] : low[k]) - f.p[k]) / f.d[k];
      if (f.d[k] != 0 && t < nearest) {
        nearest = t;
        face = 2 * k + (f.d[k] > 0 ? 1 : 0);
      }
    }
    return face;
  }
};

std::optional<float> Portals::Plane::distance(const V3& p, const V3& d) const {
  const float t = (offset - p[axis]) / d[axis];
  if (!(d[axis] * side > 0) || !(t > 0) || !std::isfinite(t)) return std::nullopt;
  return t;
}

// Rays are close together on a plane if the entropy of their light over its cells is small: e to the entropy
// is the number of cells over which the same light, spread evenly, would have it.
std::optional<Portals::Plane> Portals::best_plane(const Box& box, int face, std::span<const Found> rays) {
  Plane plane;
  plane.axis = face / 2;
  plane.side = face % 2 == 1 ? 1.f : -1.f;
  const V2 low = plane.on_plane(box.low), size = plane.on_plane(box.high) - low;
  const auto index = [](float x, float from, float length) {
    const float at = length > 0 ? ((x - from) / length + .5f) / 2 : 0;
    return static_cast<std::size_t>(std::clamp(at * kCells, 0.f, kCells - 1.f));
  };
  double light = 0;
  for (const Found& f : rays) light += double{f.light};
  std::optional<Plane> best;
  double smallest = std::numeric_limits<double>::infinity();
  std::vector<double> cells;
  for (int i = 0; i < kPlanes; ++i) {
    const float inwards = box.side(plane.axis) * (.5f * static_cast<float>(i) / kPlanes);
    plane.offset = plane.side > 0 ? box.high[plane.axis] - inwards : box.low[plane.axis] + inwards;
    cells.assign(std::size_t{kCells} * kCells, 0.);
    double through = 0;
    for (const Found& f : rays) {
      const auto t = plane.distance(f.p, f.d);
      if (!t) continue;
      const V2 at = plane.on_plane(f.p + f.d * *t);
      cells[index(at.x, low.x, size.x) * kCells + index(at.y, low.y, size.y)] += double{f.light};
      through += double{f.light};
    }
    if (!(through > kLeastThrough * light)) continue;
    double entropy = 0;
    for (const double c : cells)
      if (c > 0) entropy -= c / through * std::log(c / through);
    if (entropy < smallest) {
      smallest = entropy;
      best = plane;
    }
  }
  return best;
}

Portals::Portals(std::span<const Found> found) {
  const Box box(found);
  std::array<std::vector<Found>, 6> by_face;
  std::array<double, 6> light{};
  double all = 0;
  for (const Found& f : found) {
    const auto face = static_cast<std::size_t>(box.face_of(f));
    by_face[face].push_back(f);
    light[face] += double{f.light};
    all += double{f.light};
  }
  const float margin = kLeastMargin * std::max({box.side(0), box.side(1), box.side(2)});
  double sum = 0;
  for (std::size_t face = 0; face < by_face.size(); ++face) {
    if (!(light[face] > kLeastLight * all) || !(margin > 0)) continue;
    const auto plane = best_plane(box, static_cast<int>(face), by_face[face]);
    if (!plane) continue;
    Portal portal;
    portal.plane = *plane;
    portal.places = LearnedRectangle(kSide);
    for (const Found& f : by_face[face])
      if (const auto t = plane->distance(f.p, f.d))
        portal.places.learn(plane->on_plane(f.p + f.d * *t), std::sqrt(f.light));
    portal.places.finish(margin, 0);
    portal.probability = static_cast<float>(light[face]);
    sum += light[face];
    portals_.push_back(std::move(portal));
  }
  double up_to = 0;
  std::uint64_t words = 0;
  for (Portal& p : portals_) {
    p.first = static_cast<std::uint32_t>(words);
    up_to += double{p.probability};
    const auto end = &p == &portals_.back() ? std::uint64_t{1} << 32
                                            : static_cast<std::uint64_t>(std::ldexp(up_to / sum, 32));
    p.probability = static_cast<float>(std::ldexp(static_cast<double>(end - words), -32));
    words = end;
  }
}

std::optional<V3> Portals::sample(const V3& p, std::uint32_t x, std::uint32_t y) const {
  std::size_t i = portals_.size() - 1;
  while (portals_[i].first > x) --i;
  const Portal& portal = portals_[i];
  const std::uint64_t end = i + 1 < portals_.size() ? portals_[i + 1].first : std::uint64_t{1} << 32;
  const std::uint64_t word = (std::uint64_t{x - portal.first} << 32) / (end - portal.first);
  const auto at = portal.places.sample(static_cast<std::uint32_t>(word), unit_float(y));
  if (!at) return std::nullopt;
  V3 to = -p;
  to[portal.plane.axis] += portal.plane.offset;
  to[(portal.plane.axis + 1) % 3] += at->x;
  to[(portal.plane.axis + 2) % 3] += at->y;
  const V3 d = normalize(to);
  if (!portal.plane.distance(p, d)) return std::nullopt;
  return d;
}

float Portals::pdf(const V3& p, const V3& d) const {
  float sum = 0;
  for (const Portal& portal : portals_) {
    const auto t = portal.plane.distance(p, d);
    if (!t) continue;
    const float density = portal.places.density(portal.plane.on_plane(p + d * *t));
    sum += portal.probability * density * *t * *t / std::abs(d[portal.plane.axis]);
  }
  return sum;
}

std::uint64_t Portals::bytes() const {
  std::uint64_t sum = 0;
  for (const Portal& p : portals_) sum += sizeof(Portal) + p.places.bytes();
  return sum;
}

}  // namespace ls::render
