// Portals: the plane on which they are found, the density of their directions, and unusual input.
#include "worker/render/lights/portals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "worker/render/math/random.h"

namespace ls::render {
namespace {

using Found = Portals::Found;

// A room of 2 x 2 x 2 units about the origin, from which the sky is visible through a window. The window is
// in the plane of the given axis and offset; on the next two axes it extends from -0.1 to 0.3 and from 0.4 to
// 0.7. rays() start at points in the room and pass through the window.
struct Window {
  int axis = 0;
  float offset = .8f;

  V3 point(float u, float v) const {
    V3 q;
    q[axis] = offset;
    q[(axis + 1) % 3] = -.1f + .4f * u;
    q[(axis + 2) % 3] = .4f + .3f * v;
    return q;
  }
  bool holds(const V3& q) const {
    const float u = q[(axis + 1) % 3], v = q[(axis + 2) % 3];
    return u >= -.1f && u < .3f && v >= .4f && v < .7f;
  }
  std::vector<Found> rays(int count, RandomStream& random) const {
    std::vector<Found> all;
    while (static_cast<int>(all.size()) < count) {
      V3 p;
      for (int k = 0; k < 3; ++k) p[k] = 2 * random.uniform() - 1;
      const V3 to = point(random.uniform(), random.uniform()) - p;
      if (to[axis] * offset > 0) all.push_back({p, normalize(to), 1});
    }
    return all;
  }
};
// The share of the samples that must pass through the window: 16 times its share of the wall. It cannot be 1:
// a fifth of the samples is uniform over the portal's rectangle, which has a margin. If the portal is not
// exactly in the plane of the window, rays at grazing angles also spread on it.
constexpr double kUseful = .5;

V3 at_plane(const Window& w, const V3& p, const V3& d) {
  return p + d * ((w.offset - p[w.axis]) / d[w.axis]);
}

// The share of the samples from a point in the room that pass through the window
double share_through(const Window& window, const Portals& portals, RandomStream& random) {
  constexpr int kSamples = 2000;
  const V3 p(.1f, -.3f, .2f);
  int through = 0;
  for (int i = 0; i < kSamples; ++i) {
    const auto d = portals.sample(p, random.bits(), random.bits());
    if (d && window.holds(at_plane(window, p, *d))) ++through;
  }
  return static_cast<double>(through) / kSamples;
}

TEST(Portals, AreFoundInThePlaneOfTheWindow) {
  for (const Window& window : {Window{}, Window{0, -.8f}, Window{1, .7f}, Window{2, -.9f}}) {
    RandomStream random(3);
    const Portals portals(window.rays(4000, random));
    ASSERT_TRUE(portals.any());
    EXPECT_GT(share_through(window, portals, random), kUseful) << window.axis << ' ' << window.offset;
  }
}

std::vector<Found> through(std::initializer_list<Window> windows) {
  RandomStream random(5);
  std::vector<Found> all;
  for (const Window& w : windows) {
    const auto rays = w.rays(1000, random);
    all.insert(all.end(), rays.begin(), rays.end());
  }
  return all;
}

// The mean of a function over sampled directions is the integral of the function times the density, and the
// integral of the density is the share of samples that have a direction. Both integrals are estimated by
// uniform directions. Each test allows five standard errors.
TEST(Portals, HaveTheirStatedDensity) {
  const std::vector<Found> found = through({Window{0, .8f}, Window{1, -.7f}, Window{2, .9f}});
  const Portals portals(found);
  for (const V3& p : {V3(0, 0, 0), V3(.5f, -.2f, .6f), V3(-.9f, .9f, -.9f), V3(.95f, 0, 0), V3(2, 3, 4)}) {
    constexpr int kSamples = 1 << 18;
    RandomStream random(7);
    double sampled = 0;  // share of the samples that have a direction
    int rounded = 0;     // number of samples of density 0
    std::array<double, 2> by_samples{}, by_sphere{}, squares{}, sphere_squares{};
    const auto values = [](const V3& d) { return std::array<double, 2>{std::max(0.f, d.x), d.y * d.z}; };
    for (int i = 0; i < kSamples; ++i) {
      const auto d = portals.sample(p, random.bits(), random.bits());
      if (d && !(portals.pdf(p, *d) > 0)) ++rounded;
      for (std::size_t k = 0; d && k < 2; ++k) {
        const double v = values(*d)[k];
        by_samples[k] += v / kSamples;
        squares[k] += v * v / kSamples;
      }
      sampled += d ? 1. / kSamples : 0;
    }
    // A sample at the edge of a rectangle may be rounded to a place outside of it, where the density is 0.
    // The places of points in a room have errors of 1e-6 of the size of the rectangles.
    EXPECT_LE(rounded, 1e-4 * kSamples);
    double integral = 0, integral_squares = 0;
    for (int i = 0; i < kSamples; ++i) {
      const float z = 1 - 2 * random.uniform(), r = safe_sqrt(1 - z * z);
      const V2 phi = unit_circle(random.uniform());
      const V3 d(r * phi.x, r * phi.y, z);
      const double q = 4 * M_PI * double{portals.pdf(p, d)};
      integral += q / kSamples;
      integral_squares += q * q / kSamples;
      for (std::size_t k = 0; k < 2; ++k) {
        const double v = values(d)[k] * q;
        by_sphere[k] += v / kSamples;
        sphere_squares[k] += v * v / kSamples;
      }
    }
    const auto error = [](double square, double mean) {
      return std::sqrt((square - mean * mean) / kSamples);
    };
    EXPECT_NEAR(integral, sampled, 5 * (error(integral_squares, integral) + error(sampled, sampled)));
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_NEAR(by_sphere[k], by_samples[k],
                  5 * (error(sphere_squares[k], by_sphere[k]) + error(squares[k], by_samples[k])));
  }
}

TEST(Portals, AreIgnoredByPointsBehindThem) {
  const Portals portals(through({Window{0, .8f}}));
  RandomStream random(1);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_FALSE(portals.sample({5, .1f, .5f}, random.bits(), random.bits()));
    EXPECT_TRUE(portals.sample({-5, .1f, .5f}, random.bits(), random.bits()));
  }
  EXPECT_FALSE(portals.any_in_front_of({5, .1f, .5f}));
  EXPECT_TRUE(portals.any_in_front_of({-5, .1f, .5f}));
  EXPECT_EQ(portals.pdf({5, .1f, .5f}, {-1, 0, 0}), 0);
  EXPECT_EQ(portals.pdf({5, .1f, .5f}, {1, 0, 0}), 0);
  EXPECT_GT(portals.pdf({-5, .1f, .5f}, {1, 0, 0}), 0);
  EXPECT_EQ(portals.pdf({0, 0, 0}, {0, 1, 0}), 0) << "along the plane";
}

// Rays from the ground far outside of the room do not hide the window.
TEST(Portals, AreFoundDespiteRaysFromFarOutside) {
  RandomStream random(4);
  const Window window;
  std::vector<Found> found = window.rays(4000, random);
  for (int i = 0; i < 30; ++i) found.push_back({{1e3f * static_cast<float>(i), -1, 7e3f}, {0, 1, 0}, 1});
  const Portals portals(found);
  ASSERT_TRUE(portals.any());
  EXPECT_GT(share_through(window, portals, random), kUseful);
}

TEST(Portals, HandleOddInput) {
  EXPECT_FALSE(Portals({}).any());
  const V3 p(.1f, .2f, .3f), d(1, 0, 0);
  EXPECT_FALSE(Portals(std::vector<Found>{{p, d, 1}}).any()) << "one point encloses no room";
  // All points are on a line, so their box has no volume. Directions are along its faces and edges, and the
  // values of light span the range of float32
  std::vector<Found> flat;
  for (int i = 0; i < 100; ++i)
    flat.push_back({{static_cast<float>(i) * .01f, 0, 0},
                    i % 2 == 0 ? V3(0, 1, 0) : V3(1, 0, 0),
                    i % 3 == 0 ? 1e-38f : 1e30f});
  const Portals portals(flat);
  RandomStream random(2);
  for (int i = 0; i < 1000; ++i) {
    const auto w =
        portals.any() ? portals.sample({.5f, .1f, .2f}, random.bits(), random.bits()) : std::nullopt;
    if (w) {
      EXPECT_TRUE(is_finite(*w));
      EXPECT_GE(portals.pdf({.5f, .1f, .2f}, *w), 0);
    }
  }
}

}  // namespace
}  // namespace ls::render
