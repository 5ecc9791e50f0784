// Distances along rays: the samplers of a medium's collisions, and of points for next-event estimation.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/chi_square.h"
#include "tests/support/jacobian.h"
#include "tests/unit/render/grids.h"
#include "worker/render/integrator/equiangular.h"
#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"
#include "worker/render/media/medium.h"
#include "worker/render/media/optical_depth.h"

namespace ls::render {
namespace {

constexpr int kCells = 64, kDistanceSamples = 100000;

// Samples by cells between these edges, and a last one for what lies in none; `mass(a, b)` is the density's
// integral.
void compare(test::ChiSquareTally& tally, const std::string& name, const std::vector<double>& edges,
             const std::function<double(double, double)>& mass,
             const std::function<double(RandomStream&)>& sample) {
  std::vector<double> expected, got(edges.size(), 0);
  double inside = 0;
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    expected.push_back(mass(edges[i], edges[i + 1]) * kDistanceSamples);
    inside += expected.back();
  }
  expected.push_back(std::max(0., kDistanceSamples - inside));
  EXPECT_LE(inside, kDistanceSamples * (1 + 1e-5)) << name;
  RandomStream r(41);
  for (int i = 0; i < kDistanceSamples; ++i) {
    const double x = sample(r);
    const auto it = std::upper_bound(edges.begin(), edges.end(), x);
    const bool in = it != edges.begin() && it != edges.end();
    ++got[in ? static_cast<std::size_t>(it - edges.begin()) - 1 : got.size() - 1];
  }
  tally.expect(name, expected, got);
}

// Of a density: Simpson's rule in 64 parts.
std::function<double(double, double)> integral_of(const std::function<double(double)>& f) {
  return [f](double a, double b) {
    constexpr int kParts = 64;
    double sum = 0;
    const double h = (b - a) / kParts;
    for (int i = 0; i < kParts; ++i) sum += f(a + i * h) + 4 * f(a + (i + .5) * h) + f(a + (i + 1) * h);
    return sum * h / 6;
  };
}
std::vector<double> even(double lo, double hi, int cells = kCells) {
  std::vector<double> e;
  for (int i = 0; i <= cells; ++i) e.push_back(lo + (hi - lo) * i / cells);
  return e;
}

void exponentials(test::ChiSquareTally& tally) {
  const auto mass = [](double a, double b) { return std::exp(-a) - std::exp(-b); };
  compare(tally, "exponential of 32 bits", even(0, 8), mass,
          [](RandomStream& r) { return exponential(r.bits()); });
  compare(tally, "exponential of a stream", even(0, 8), mass,
          [](RandomStream& r) { return r.exponential(); });
  for (const float depth : {1e-30f, 1e-7f, .1f, 3.f, 50.f, 1e5f})
    for (const float length : {1e-3f, 10.f}) {
      const float sigma = depth / length;
      const double reach = std::min<double>(length, 8. * length / std::max(depth, 1e-30f));
      compare(tally, fmt::format("truncated to depth {}, length {}", depth, length), even(0, reach),
              integral_of([=](double x) { return truncated_pdf(sigma, length, static_cast<float>(x)); }),
              [=](RandomStream& r) { return truncated_sample(sigma, length, (r.bits() + .5) * 0x1p-32); });
      // Half of the cells where all of the exponential share lies, if that is not everywhere.
      const double near = std::min<double>(length, 20. * length / std::max(depth, 1e-30f));
      std::vector<double> edges = even(0, near, kCells / 2);
      if (near < length) {
        const std::vector<double> rest = even(near, length, kCells / 2);
        edges.insert(edges.end(), rest.begin() + 1, rest.end());
      }
      compare(tally, fmt::format("mixed, depth {}, length {}", depth, length), edges,
              integral_of([=](double x) { return mixed_depth_pdf(sigma, length, static_cast<float>(x)); }),
              [=](RandomStream& r) { return mixed_depth_sample(sigma, length, r.bits()); });
    }
}

struct Segment {
  float a, b, distance;
};
const Segment kSegments[] = {{-3, 3, .5f}, {-3, 3, .01f}, {100, 101, .01f},   {-2, -1, .3f},
                             {0, 1, 1},    {0, 4, .05f},  {-.5f, .25f, 1e4f}, {5, 5.01f, 2}};
EquiAngular angles(const Segment& s) { return {V3(s.a, 0, 0), V3(1, 0, 0), s.b - s.a, V3(0, s.distance, 0)}; }

// Cells of equal angle about the foot: between them the density varies by orders of magnitude.
void equiangular(test::ChiSquareTally& tally) {
  for (const Segment& s : kSegments) {
    const double a = std::atan2(double{s.a}, double{s.distance}),
                 b = std::atan2(double{s.b}, double{s.distance});
    std::vector<double> edges = even(a, b);
    for (double& e : edges) e = std::clamp(s.distance * std::tan(e) - s.a, 0., double{s.b} - s.a);
    edges.back() *= 1 + 1e-6;  // rounding may put the last ones at the end itself
    compare(tally, fmt::format("equi-angular {} {} at {}", s.a, s.b, s.distance), edges,
            integral_of([&](double t) { return angles(s).pdf(static_cast<float>(t)); }),
            [&](RandomStream& r) { return angles(s).sample(r.uniform()).t; });
  }
}

// The same where each channel has a density of its own: tracked, and followed exactly.
void channel_flights(test::ChiSquareTally& tally) {
  const V3 o(-1, .3f, 1.1f), d = normalize(V3(9, 7.1f, 6.2f));
  for (const float sigma : {.4f, 40.f}) {
    std::vector<Grid> grids;
    for (int c = 0; c < 3; ++c) {
      std::vector<float> v = random_values({9, 9, 9}, static_cast<unsigned>(30 + c), c == 1);
      for (float& x : v) x *= c == 2 ? 3.f : 1.f;
      grids.push_back(unit_grid({9, 9, 9}, std::move(v)));
      grids.back().use_cells(4);
    }
    const Grid mean = Grid::mean(grids[0], grids[1], grids[2]);
    Medium m;
    m.grid = true;
    m.density = &mean;
    m.by_channel = {&grids[0], &grids[1], &grids[2]};
    m.sigma_t = C3(sigma);
    for (const int hero : {0, 1, 2}) {
      const Grid& own = grids[static_cast<std::size_t>(hero)];
      const auto depth = [&](double t) { return double{sigma} * exact_integral(own, V3d(o), V3d(d), 0, t); };
      MediumCounters counters;
      compare(
          tally, fmt::format("channel {} of a grid of {}", hero, sigma), even(1, sigma > 10 ? 3 : 14),
          [&](double a, double b) { return std::exp(-depth(a)) - std::exp(-depth(b)); },
          [&](RandomStream& r) {
            const std::uint32_t bits = r.bits();
            const Flight f =
                free_flight<kEverything>(m, hero, bits, o, d, 30, RandomStream(r.next()), counters);
            return f.scattered ? double{f.t} : 1e9;
          });
      EXPECT_EQ(counters.majorant_violations, 0u);
    }
  }
}

// Points that `volpath_distant_mis` proposes by depth: along the macro cells' means.
void proposals_in_grids(test::ChiSquareTally& tally) {
  const V3 o(-1, .3f, 1.1f), d = normalize(V3(9, 7.1f, 6.2f));
  std::vector<float> plume(17 * 17 * 17, 0);
  for (std::size_t i = 0; i < plume.size(); ++i)
    plume[i] = i % 17 > 5 && i % 17 < 12 ? static_cast<float>(i % 7) / 3 : 0.f;
  for (const auto& [name, grid] : {std::pair{"dense", unit_grid({9, 9, 9}, random_values({9, 9, 9}, 5))},
                                   {"sparse", unit_grid({9, 9, 9}, random_values({9, 9, 9}, 6, true))},
                                   {"plume", unit_grid({17, 17, 17}, plume)}}) {
    Medium m;
    m.grid = true;
    m.density = &grid;
    const float sigma = .8f;
    m.sigma_t = C3(sigma);
    const OpticalDepth s(m, o, d, 30);
    compare(
        tally, fmt::format("proposed by depth in a {} grid", name), even(s.from(), s.to() * (1 + 1e-6)),
        [&](double a, double b) {
          // The integral over a cell of the table, which is one of x: rate is dx / dt.
          const auto share = [&](double t) {
            const float x = s.at(std::min(static_cast<float>(t), s.to())).x;
            const double even = x / s.total(), part = std::expm1(-sigma * x) / std::expm1(-sigma * s.total());
            const double kept = kEvenShare * 0x1p-32;
            return (1 - kept) * part + kept * even;
          };
          return share(b) - share(a);
        },
        [&](RandomStream& r) { return s.after(mixed_depth_sample(sigma, s.total(), r.bits())).t; });
    // And x and rate belong together.
    const OpticalDepth::Point a = s.at(6), b = s.at(6.001f);
    EXPECT_NEAR((b.x - a.x) / .001, a.rate, .01 * a.rate + 1e-3) << name;
  }
}

// First collisions of delta tracking in a grid: the hero's exact optical depth by quadrature of the voxels.
void flights(test::ChiSquareTally& tally) {
  struct Field {
    const char* name;
    Grid grid;
    C3 sigma;
  };
  const auto values = [](unsigned seed, bool sparse = false) {
    return random_values({9, 9, 9}, seed, sparse);
  };
  std::vector<Field> fields;
  fields.push_back({"dense grid", unit_grid({9, 9, 9}, values(5)), C3(.3f)});
  fields.push_back({"sparse grid", unit_grid({9, 9, 9}, values(6, true)), C3(2)});
  fields.push_back({"opaque grid", unit_grid({9, 9, 9}, values(8)), C3(40)});  // followed exactly
  fields.push_back({"chromatic grid", unit_grid({9, 9, 9}, values(7)), C3(.1f, .2f, .6f)});
  fields.push_back({"nearest grid", voxel_grid({9, 9, 9}, values(11), kNearest, Wrap::clamp), C3(.3f)});
  fields.push_back({"repeated grid", voxel_grid({9, 9, 9}, values(13), kTrilinear, Wrap::repeat), C3(.3f)});
  const V3 o(-1, .3f, 1.1f), d = normalize(V3(9, 7.1f, 6.2f));
  for (const Field& f : fields)
    for (const int hero : {0, 2}) {
      Medium m;
      m.grid = true;
      m.density = &f.grid;
      m.sigma_t = f.sigma;
      const auto depth = [&](double t) {
        return double{f.sigma[hero]} * exact_integral(f.grid, V3d(o), V3d(d), 0, t);
      };
      MediumCounters counters;
      const double reach = f.sigma.x > 10 ? 2.5 : 14;
      compare(
          tally, fmt::format("{}, hero {}", f.name, hero), even(1, reach),
          [&](double a, double b) { return std::exp(-depth(a)) - std::exp(-depth(b)); },
          [&](RandomStream& r) {
            const std::uint32_t bits = r.bits();
            const Flight flight =
                free_flight<kEverything>(m, hero, bits, o, d, 30, RandomStream(r.next()), counters);
            return flight.scattered ? double{flight.t} : 1e9;
          });
      EXPECT_EQ(counters.majorant_violations, 0u) << f.name;
    }
  channel_flights(tally);
  proposals_in_grids(tally);
  Medium fog;
  fog.sigma_t = C3(.2f, .5f, 2);
  for (const int hero : {0, 1, 2})
    compare(
        tally, fmt::format("homogeneous, hero {}", hero), even(0, 4),
        [&](double a, double b) {
          return std::exp(-fog.sigma_t[hero] * a) - std::exp(-fog.sigma_t[hero] * b);
        },
        [&](RandomStream& r) {
          MediumCounters counters;
          const std::uint32_t bits = r.bits();
          const Flight f =
              free_flight<kEverything>(fog, hero, bits, o, d, 4, RandomStream(r.next()), counters);
          return f.scattered ? double{f.t} : 1e9;
        });
}

TEST(Distances, FollowTheirDensity) {
  test::ChiSquareTally tally("sampling/distances");
  exponentials(tally);
  equiangular(tally);
  flights(tally);
  tally.close();
}

TEST(Distances, DerivativeIsOneOverTheDensity) {
  for (const float depth : {1e-30f, .1f, 3.f, 50.f})
    test::expect_slope(
        fmt::format("truncated to depth {}", depth),
        [=](double u) { return truncated_sample(depth / 2, 2, u); },
        [=](double x) { return truncated_pdf(depth / 2, 2, static_cast<float>(x)); }, 2 * 0x1p-24);
  for (const Segment& s : kSegments)
    test::expect_slope(
        fmt::format("equi-angular {} {} at {}", s.a, s.b, s.distance),
        [&](double u) { return angles(s).sample(static_cast<float>(u)).t; },
        [&](double t) { return angles(s).pdf(static_cast<float>(t)); },
        // Of the number, half a unit in its last place of 1 turns into a share of the length.
        0x1p-23 * std::max(std::abs(s.a), std::abs(s.b)));
}

}  // namespace
}  // namespace ls::render
