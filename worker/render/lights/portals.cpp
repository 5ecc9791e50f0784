#include "worker/render/lights/portals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "worker/render/math/random.h"

namespace ls::render {
namespace {

// A face of the box around most of the rays' origins (Box) gets a portal if more than this share of the sky's
// light leaves through it.
constexpr double kLeastLight = .02;
// More than this share of the light that leaves through a face must pass through the plane that is chosen for
// the face. Rays that begin between the plane and the face do not pass through the plane.
constexpr double kLeastThrough = .9;
// The share of the rays' origins that lie beyond each face of the box
constexpr double kOutliers = .01;
// For each face kPlanes planes parallel to it are tried. The first lies outside of the box, at kBeyond times
// the box's side from the face; the last lies near the middle of the box.
constexpr int kPlanes = 40;
constexpr float kBeyond = .1f;
// A plane is divided into kCells x kCells cells to measure how concentrated the rays are on it. The cells
// cover twice the face's width and height; the places of rays farther out are not learned.
constexpr int kCells = 128;
constexpr std::size_t kSide = 16;  // cells across and down a portal's rectangle
// The margin of a portal's rectangle is the sum of these shares of the box's size and of its largest
// coordinate. The second is larger than the rounding errors of places.
constexpr float kLeastMargin = 1e-4f;
constexpr float kRounding = 1e-5f;

}  // namespace

// The box in which most of the rays begin. It leaves out the few origins that lie far away, such as those on
// the ground outside of a room: with them the box would be so large that the tried planes would be far apart.
struct Portals::Box {
  V3 low{0, 0, 0}, high{0, 0, 0};

  explicit Box(std::span<const Found> found) {
    const auto last = static_cast<std::ptrdiff_t>(found.size()) - 1;
    const auto outliers = static_cast<std::ptrdiff_t>(kOutliers * static_cast<double>(found.size()));
    std::vector<float> values(found.size());
    for (int k = 0; k < 3 && last >= 0; ++k) {
      for (std::size_t i = 0; i < found.size(); ++i) values[i] = found[i].p[k];
      const auto value_at = [&](std::ptrdiff_t n) {
        std::nth_element(values.begin(), values.begin() + n, values.end());
        return values[static_cast<std::size_t>(n)];
      };
      low[k] = value_at(outliers);
      high[k] = value_at(last - outliers);
    }
  }
  bool contains(const V3& p) const {
    for (int k = 0; k < 3; ++k)
      if (!(p[k] >= low[k] && p[k] <= high[k])) return false;
    return true;
  }
  // The largest absolute coordinate of the box; rounding errors are proportional to it.
  float reach() const {
    float r = 0;
    for (int k = 0; k < 3; ++k) r = std::max({r, std::abs(low[k]), std::abs(high[k])});
    return r;
  }
  float side(int axis) const { return high[axis] - low[axis]; }
  // The place at which a ray crosses a plane: on_plane in the plane's two coordinates, and of_box relative to
  // the rectangle of the cells, from 0 to less than 1 along each side. nullopt if the ray does not cross the
  // plane in this rectangle.
  struct Place {
    V2 on_plane, of_box;
  };
  std::optional<Place> place_on(const Plane& plane, const Found& f) const {
    const auto t = plane.distance(f.p, f.d);
    if (!t) return std::nullopt;
    const V2 at = plane.on_plane(f.p + f.d * *t), from = plane.on_plane(low),
             size = plane.on_plane(high) - from;
    const V2 share((at.x - from.x) / size.x / 2 + .25f, (at.y - from.y) / size.y / 2 + .25f);
    if (!(share.x >= 0 && share.x < 1 && share.y >= 0 && share.y < 1)) return std::nullopt;
    return Place{at, share};
  }
  // Returns the number of the face through which a ray from inside leaves the box. The two faces
  // perpendicular to an axis have the numbers 2 axis (at the smaller p[axis]) and 2 axis + 1 (at the larger).
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
  if (!(d[axis] * side > 0)) return std::nullopt;
  const float t = (offset - p[axis]) / d[axis];
  return std::isfinite(t) && t > 0 ? std::optional(t) : std::nullopt;
}

// Tries planes parallel to the face and returns the one on which the rays' light is most concentrated: the
// one with the smallest entropy of the light over the plane's cells. Light with this entropy is as
// concentrated as light spread evenly over exp(entropy) cells. Planes through which too little of the light
// passes (kLeastThrough) are skipped; the result is nullopt if all are skipped.
std::optional<Portals::Plane> Portals::best_plane(const Box& box, int face, std::span<const Found> rays) {
  Plane plane;
  plane.axis = face / 2;
  plane.side = face % 2 == 1 ? 1.f : -1.f;
  double light = 0;
  for (const Found& f : rays) light += double{f.light};
  std::optional<Plane> best;
  double smallest = std::numeric_limits<double>::infinity();
  std::vector<double> cells;
  for (int i = 0; i < kPlanes; ++i) {
    const float inwards =
        box.side(plane.axis) * ((.5f + kBeyond) * static_cast<float>(i) / kPlanes - kBeyond);
    plane.offset = plane.side > 0 ? box.high[plane.axis] - inwards : box.low[plane.axis] + inwards;
    cells.assign(std::size_t{kCells} * kCells, 0.);
    double through = 0;
    for (const Found& f : rays) {
      const auto at = box.place_on(plane, f);
      if (!at) continue;
      const V2 cell = at->of_box * kCells;
      cells[static_cast<std::size_t>(cell.x) * kCells + static_cast<std::size_t>(cell.y)] += double{f.light};
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
    if (!box.contains(f.p)) continue;
    const auto face = static_cast<std::size_t>(box.face_of(f));
    by_face[face].push_back(f);
    light[face] += double{f.light};
    all += double{f.light};
  }
  const float size = std::max({box.side(0), box.side(1), box.side(2)});
  const float margin = kLeastMargin * size + kRounding * box.reach();
  for (std::size_t face = 0; face < by_face.size(); ++face) {
    if (!(light[face] > kLeastLight * all) || !(size > 0)) continue;
    const auto plane = best_plane(box, static_cast<int>(face), by_face[face]);
    if (!plane) continue;
    Portal portal;
    portal.plane = *plane;
    portal.places = LearnedRectangle(kSide);
    for (const Found& f : by_face[face])
      if (const auto at = box.place_on(*plane, f)) portal.places.learn(at->on_plane, std::sqrt(f.light));
    portal.places.finish(margin, 0);
    portal.weight = static_cast<float>(light[face] / all);
    portals_.push_back(std::move(portal));
  }
}

float Portals::weight_in_front_of(const V3& p) const {
  float sum = 0;
  for (const Portal& portal : portals_)
    if (portal.plane.is_in_front_of(p)) sum += portal.weight;
  return sum;
}

std::optional<V3> Portals::sample(const V3& p, std::uint32_t x, std::uint32_t y) const {
  // x chooses a portal. The position of x among the words that choose the same portal is used again to choose
  // a place on it.
  const double sum = double{weight_in_front_of(p)}, at = std::ldexp((double{x} + .5) * sum, -32);
  const Portal* chosen = nullptr;
  double before = 0;
  for (const Portal& portal : portals_) {
    if (!portal.plane.is_in_front_of(p)) continue;
    if (chosen) {
      if (at < before + double{chosen->weight}) break;
      before += double{chosen->weight};
    }
    chosen = &portal;
  }
  if (!chosen) return std::nullopt;
  const double left = (at - before) / double{chosen->weight};
  const auto word = static_cast<std::uint32_t>(std::ldexp(std::clamp(left, 0., double{kBelowOne}), 32));
  const auto place = chosen->places.sample(word, unit_float(y));
  if (!place) return std::nullopt;
  V3 to = -p;
  to[chosen->plane.axis] += chosen->plane.offset;
  to[(chosen->plane.axis + 1) % 3] += place->x;
  to[(chosen->plane.axis + 2) % 3] += place->y;
  const V3 d = normalize(to);
  if (!chosen->plane.distance(p, d)) return std::nullopt;
  return d;
}

float Portals::pdf(const V3& p, const V3& d) const {
  float sum = 0;
  for (const Portal& portal : portals_) {
    const auto t = portal.plane.distance(p, d);
    if (!t) continue;
    const float density = portal.places.density(portal.plane.on_plane(p + d * *t));
    sum += portal.weight * density * *t * *t / std::abs(d[portal.plane.axis]);
  }
  return sum > 0 ? sum / weight_in_front_of(p) : 0;
}

std::uint64_t Portals::bytes() const {
  std::uint64_t sum = 0;
  for (const Portal& p : portals_) sum += sizeof(Portal) + p.places.bytes();
  return sum;
}

}  // namespace ls::render
