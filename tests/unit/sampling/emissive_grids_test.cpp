// Emissive grids as lights: the directions that are sampled towards them, against the density that is claimed
// for a ray in such a direction.
#include "worker/render/lights/emissive_grids.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/chi_square.h"
#include "tests/support/sphere_cells.h"
#include "tests/unit/render/grids.h"
#include "worker/render/math/random.h"
#include "worker/render/media/field.h"

namespace ls::render {
namespace {

constexpr int kEmissiveSamples = 100000, kEmissiveRows = 8, kEmissiveColumns = 8;

// A medium that is as dense as it emits per length
Medium emitting(const Grid& g) {
  Medium m;
  m.grid = true;
  m.density = &g;
  m.sigma_t = C3(1);
  m.emission_kind = EmissionKind::per_length;
  m.emission = C3(1, 2, 3);
  m.emitter = {&g, &g, &g};
  return m;
}

struct EmissiveCase {
  std::string name;
  std::vector<Medium> media;
  V3 from{0, 0, 0}, towards{0, 0, 1};  // `towards`: the axis of the cells of directions
  double reach = 2;                    // of these cells: 1 - cos
};

class EmissiveCases {
 public:
  EmissiveCases() {
    const Grid& fire = add(grid_of({12, 12, 12}, 3));
    const Grid& smoke = add(grid_of({9, 14, 10}, 4));
    const Grid& one = add(voxel_grid({1, 1, 1}, {1}, kNearest, Wrap::clamp));
    const V3 middle(5.5f, 5.5f, 5.5f), beside(40, -3, 7);
    all.push_back({"from the inside", {emitting(fire)}, {3.2f, 4.1f, 8.7f}});
    all.push_back({"from the inside of one voxel", {emitting(one)}, {.1f, -.2f, .3f}});
    all.push_back({"from beside it", {emitting(fire)}, beside, middle - beside, .05});
    const V3 far(4e4f, -3e3f, 7e3f);
    all.push_back({"from far away", {emitting(fire)}, far, middle - far, 3e-8});
    all.push_back({"by absorption", {by_absorption(smoke)}, {4, 6, 5}});
    Medium hot = by_absorption(smoke);
    hot.emitter = {&fire, &fire, &fire};
    hot.emission_kind = EmissionKind::black_body;
    hot.kelvin_scale = 3000;
    hot.weight = &smoke;
    all.push_back({"black bodies", {hot}, {4, 6, 5}});
    all.push_back({"two media", {emitting(fire), by_absorption(smoke)}, {6, 2, 3}});
    Affine flat;  // of voxels of 1 x 1/2 x 1/30, mirrored
    flat.a = {1, 0, 0, 0, -2, 0, 0, 0, 30};
    const Grid& wide =
        add({{12, 12, 12}, random_values({12, 12, 12}, 8, true), flat, V3d(0), V3d(11, 11, 11), 1});
    all.push_back({"voxels of unlike sides", {emitting(wide)}, {5, -2, .2f}});
    const Grid& torn = add({noise_, Affine{}, V3d(0), V3d(11, 9, 12), 4});
    all.push_back({"noise", {emitting(torn)}, {4, 5, 6}});
    all.push_back({"noise by absorption", {by_absorption(torn)}, {4, 5, -6}});
  }
  std::vector<EmissiveCase> all;

 private:
  static Grid grid_of(Size n, unsigned seed) { return unit_grid(n, random_values(n, seed, true)); }
  const Grid& add(Grid g) { return grids_.emplace_back(std::move(g)); }
  static Medium by_absorption(const Grid& density) {
    Medium m = emitting(density);
    m.emission_kind = EmissionKind::per_absorption;
    m.emitter = {};
    return m;
  }
  static Field noise() {
    NoiseVolume v;
    v.scale = .4;
    std::vector<Field::Part> parts;
    parts.emplace_back(Field::Noisy{Affine::scale_translate(v.scale, V3d(0)), FractalNoise(v), -.2f, 1});
    return Field(std::move(parts));
  }
  const Field noise_ = noise();
  std::deque<Grid> grids_;  // a deque, since media point at its elements
};

TEST(EmissiveGrids, AreSampledWithTheirStatedDensity) {
  test::ChiSquareTally tally("sampling/emissive_grids");
  for (const EmissiveCases cases; const EmissiveCase& c : cases.all) {
    SCOPED_TRACE(c.name);
    const EmissiveGrids lights(c.media);
    ASSERT_TRUE(lights.any());
    const test::SphereCells cells(c.towards, c.reach, kEmissiveRows, kEmissiveColumns);
    // The density has edges where a ray passes from one cell of a grid to the next, so the sum over 48 x 48
    // points of a cell of directions is right to about 1 / 48^2. The test asks for 1 / sqrt(samples in it).
    const auto masses = cells.masses([&](const V3& w) { return double{lights.pdf(c.from, w)}; }, 48);
    EXPECT_NEAR(cells.total(), 1, 2e-3) << "the density's integral over all directions";
    std::vector<double> observed(cells.size(), 0);
    RandomStream r(17);
    for (int i = 0; i < kEmissiveSamples; ++i) {
      const auto s = lights.sample(c.from, {{r.bits(), r.bits(), r.bits(), r.bits()}}, r);
      ASSERT_TRUE(s);
      // sample() takes the density from the direction that it returns
      ASSERT_EQ(s->pdf, lights.pdf(c.from, s->w));
      ++observed[cells.of(s->w)];
    }
    tally.expect(c.name, test::counts(masses, kEmissiveSamples), observed);
  }
  tally.close();
}

TEST(EmissiveGrids, AreEmptyWithoutLightThatVaries) {
  const Grid none = unit_grid({4, 4, 4}, std::vector<float>(64, 0)),
             full = unit_grid({4, 4, 4}, std::vector<float>(64, 1));
  EXPECT_TRUE(EmissiveGrids(std::vector{emitting(full)}).any());
  EXPECT_FALSE(EmissiveGrids(std::vector{emitting(none)}).any());
  // The extent of an emission without a grid is that of the medium's boundary
  Medium even = emitting(full);
  even.emitter = {};
  EXPECT_FALSE(EmissiveGrids(std::vector{even}).any());
  EXPECT_FALSE(EmissiveGrids(std::vector<Medium>{}).any());
  EXPECT_EQ(EmissiveGrids().pdf({0, 0, 0}, {0, 0, 1}), 0);
}

// Along a ray, the mean of emission over density is the integral of the emission.
TEST(EmissiveGrids, PointsOnARayGiveTheIntegralOfTheEmission) {
  const Grid fire = unit_grid({12, 12, 12}, random_values({12, 12, 12}, 3, true));
  const Medium m = emitting(fire);
  const EmissiveGrids lights(std::vector{m});
  // From so far away that all sampled directions are one ray, up to the spread of the grid's width over the
  // distance. The first number decides the cell, the others the point in it: always the same.
  RandomStream r(5);
  const V3 from(-30, 5.2f, 6.1f);
  const Group numbers{{1u << 30, 1u << 31, 1u << 31, 1u << 31}};
  constexpr int kPoints = 40000;
  double sum = 0, square = 0;
  V3 w(0);
  for (int i = 0; i < kPoints; ++i) {
    const auto s = lights.sample(from, numbers, r);
    ASSERT_TRUE(s);
    const double value = double{s->emission.x} / double{s->pdf_of_distance};
    sum += value / kPoints;
    square += value * value / kPoints;
    w = s->w;
  }
  const double error = std::sqrt((square - sum * sum) / kPoints);
  EXPECT_LT(error, .02 * sum) << "the test has no power";
  EXPECT_NEAR(sum, exact_integral(fire, V3d(from), V3d(w), 0, 100), test::kStandardErrors * error);
}

// A grid that is dim, but so large that beside it a cell of the other would get no word in proportion
TEST(EmissiveGrids, EveryCellThatMayEmitIsFound) {
  std::vector<float> flame(32 * 32 * 32, 1e-6f);
  flame[0] = 1;
  const Grid small = unit_grid({32, 32, 32}, flame);
  Affine shrunk;  // from the world to index coordinates: the grid is a million units wide
  shrunk.a = {1e-6, 0, 0, 0, 1e-6, 0, 0, 0, 1e-6};
  const Grid large{{2, 2, 2}, std::vector<float>(8, 1e-3f), shrunk, V3d(0), V3d(1, 1, 1), 1};
  const std::vector<Medium> media{emitting(small), emitting(large)};
  const EmissiveGrids lights(media);
  EXPECT_TRUE(lights.has(0) && lights.has(1));
  std::size_t cells = 0;
  for (const Grid* grid : {&small, &large}) {
    const auto n = grid->cells();
    cells += static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
  }
  EXPECT_EQ(lights.cell_count(), cells);
}

TEST(EmissiveGrids, AnswerUnusualPoints) {
  const Grid fire = unit_grid({5, 5, 5}, random_values({5, 5, 5}, 2));
  const Medium m = emitting(fire);
  const EmissiveGrids lights(std::vector{m});
  constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();
  for (const V3& x : {V3(kNotANumber), V3(kInfinity), V3(3e38f), V3(1e30f, 0, 0)})
    for (std::uint32_t word : {0u, 1u, ~0u}) {
      RandomStream r(word);
      EXPECT_FALSE(lights.sample(x, {{word, word, word, word}}, r)) << x;
    }
  EXPECT_EQ(lights.pdf({0, 0, 0}, V3(kNotANumber)), 0);
}

}  // namespace
}  // namespace ls::render
