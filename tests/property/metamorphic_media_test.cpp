// What must not change an image: how a medium is written down, where nothing is, and which way light goes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/property/compare.h"
#include "tests/property/structures.h"

namespace ls::test {
namespace {

void expect_alike(Tests& tests, const SceneBuilder& a, const SceneBuilder& b, std::uint64_t seed,
                  Looks looks = {256, 4096}) {
  const Comparison c = look(a, b, seed, tests.level(3), looks);
  EXPECT_EQ(c.verdict, Verdict::alike) << c.told;
}

// A medium in the cube [-1, 1]^3 under the sun, on a floor.
template <class Make>
SceneBuilder sunlit(Make make) {
  SceneBuilder builder({12, 12});
  builder.shape(RectangleShape{}, translate({0, 0, -1.25}) * scale(4), builder.diffuse(.5));
  builder.container(CubeShape{}, {}, builder.null(), make(builder));
  builder.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, {1, 1, 1}});
  builder.scene.emitters.push_back(PointEmitter{{0, -2, 2}, {3, 2, 1}});
  builder.look({0, -5, 2}, {0, 0, 0}, 30);
  builder.scene.integrator.max_depth = 8;
  return builder;
}

// Values at the nodes from face to face; twice as many nodes between which the field is the same.
VolumeIndex nodes(SceneBuilder& builder, int n, const std::vector<float>& values) {
  const VolumeIndex v = builder.grid({n, n, n}, values, translate({-1, -1, -1}) * scale(2));
  std::get<GridVolume>(builder.scene.volumes[v.value]).node_centred = true;
  return v;
}
std::vector<float> refined(int n, const std::vector<float>& v) {
  const int m = 2 * n - 1;
  std::vector<float> out;
  const auto at = [&](int x, int y, int z) { return v[static_cast<std::size_t>((z * n + y) * n + x)]; };
  for (int z = 0; z < m; ++z)
    for (int y = 0; y < m; ++y)
      for (int x = 0; x < m; ++x) {
        float sum = 0;
        for (int k = 0; k < 8; ++k) sum += at((x + (k & 1)) / 2, (y + (k >> 1 & 1)) / 2, (z + (k >> 2)) / 2);
        out.push_back(sum / 8);
      }
  return out;
}

TEST(Metamorphic, TrilinearFieldIsTheSameOnATwiceAsFineGrid) {
  Tests tests("property/twice_the_grid");
  std::mt19937 random(4);
  std::vector<float> values(5 * 5 * 5);
  for (float& v : values) v = static_cast<float>(random() % 64) / 16;
  for (const char* integrator : {"volpath", "volpath_distant_mis"}) {
    const auto with = [&](int n, const std::vector<float>& v) {
      SceneBuilder builder = sunlit([&](SceneBuilder& k) {
        return k.heterogeneous(nodes(k, n, v), {.9, .8, .7}, 1, .3);
      });
      builder.scene.integrator.name = integrator;
      return builder;
    };
    expect_alike(tests, with(5, values), with(9, refined(5, values)), 1);
  }
  tests.close();
}

// Half the size and twice the density: the same optical depths. Seen from as near, in the same bits.
TEST(Metamorphic, HalfSizeAtTwiceTheDensityIsTheSame) {
  const auto with = [](double size) {
    SceneBuilder builder({12, 12});
    builder.container(CubeShape{}, scale(size), builder.null(),
                      builder.homogeneous({.5 / size, 1 / size, 2 / size}, {.9, .8, .7}, .5));
    builder.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, {1, 1, 1}});
    builder.look({0, -5 * size, 2 * size}, {0, 0, 0}, 30);
    builder.scene.sensor.near_clip *= size;
    builder.scene.sensor.far_clip *= size;
    return builder;
  };
  const PixelRect all{0, 0, 12, 12};
  const auto one = render::render_tile(*world_of(with(1)), all, {0, 4}, nullptr, nullptr);
  EXPECT_EQ(render::render_tile(*world_of(with(.5)), all, {0, 4}, nullptr, nullptr).sums, one.sums);
}

// Density beyond the container that no ray meets, in the macro cells that they cross: majorants are four
// orders of magnitude too large.
TEST(Metamorphic, MajorantTenThousandTimesTooLargeChangesNothing) {
  Tests tests("property/majorant");
  for (const char* integrator : {"volpath", "volpath_distant_mis"}) {
    const auto with = [&](float outside) {
      std::vector<float> values(12 * 12 * 12, 1);
      for (int i = 0; i < 12; ++i)
        for (int j = 0; j < 12; ++j) values[static_cast<std::size_t>((i * 12 + j) * 12 + 11)] = outside;
      SceneBuilder builder = sunlit([&](SceneBuilder& k) {
        // The last layer of voxels, and what is interpolated towards it, lie beyond x = 1.
        return k.heterogeneous(k.grid({12, 12, 12}, values, translate({-1, -1, -1}) * scale(2.5, 2, 2)),
                               {.9, .8, .7});
      });
      builder.scene.integrator.name = integrator;
      return builder;
    };
    expect_alike(tests, with(1), with(1e4f), 20, {64, 256});
  }
  tests.close();
}

TEST(Metamorphic, NullBoundariesChangeNothing) {
  Tests tests("property/boundaries");
  std::uint64_t seed = 40;
  for (const NamedScene& s : different_scenes()) {
    SceneBuilder more = s.builder;
    const BsdfIndex null = more.null();
    // Within the media, across their boundaries, around everything. None of them says what is on its sides.
    for (const double r : {.25, .7, 1.2, 9.})
      more.shape(SphereShape{}, translate({.1, .05, 0}) * scale(r), null);
    more.shape(RectangleShape{}, rotate_x(30) * scale(3), null);
    expect_alike(tests, s.builder, more, seed += 10, {64, 1024});
  }
  tests.close();
}

// Radiance towards b of a slab lit from a, by irradiance on the slab, is that towards a lit from b.
TEST(Metamorphic, SlabIsReciprocal) {
  Tests tests("property/both_ways");
  const auto direction = [](double degrees) {
    return Vec3{std::sin(degrees * kPi / 180), 0, std::cos(degrees * kPi / 180)};
  };
  const auto seen = [&](double to, double from, bool beyond, const char* integrator) {
    SceneBuilder builder({8, 8});
    builder.container(CubeShape{}, scale(1e4, 1e4, 1), builder.null(),
                      builder.homogeneous({.3, .6, 1.2}, {.95, .8, .6}, .6));
    const Vec3 in = direction(from), out = direction(to);
    // Per irradiance on the slab, which gets the cosine of what faces the light.
    const double e = 1 / in[2];
    builder.scene.emitters.push_back(DirectionalEmitter{{-in[0], 0, -in[2]}, {e, e, e}});
    const double side = beyond ? -1 : 1;
    builder.look({5 * side * out[0], 0, 5 * side * out[2]}, {0, 0, 0}, 1e-2, {0, 1, 0});
    builder.scene.integrator.name = integrator;
    return builder;
  };
  std::uint64_t seed = 200;
  for (const char* integrator : {"volpath", "volpath_distant_mis"})
    for (const bool beyond : {false, true})
      expect_alike(tests, seen(20, 65, beyond, integrator), seen(65, 20, beyond, integrator), seed += 10);
  tests.close();
}

// A sample is its own: alone, in any order and in any company it is the same.
TEST(Metamorphic, OrderOfSamplesDoesNotMatter) {
  for (const NamedScene& s : different_scenes()) {
    const auto world = world_of(s.builder);
    const auto tile = render::render_tile(*world, {3, 4, 6, 6}, {0, 8}, nullptr, nullptr);
    for (int y = 5; y >= 4; --y)
      for (int x = 5; x >= 3; --x) {
        double sum[2][3] = {}, value[8][3];
        for (const std::uint64_t n : {7, 0, 3, 6, 1, 2, 5, 4}) {
          const auto v = render::render_sample(*world, x, y, n);
          std::copy(std::begin(v.rgb), std::end(v.rgb), value[n]);
        }
        for (std::size_t n = 0; n < 8; ++n)
          for (std::size_t c = 0; c < 3; ++c) sum[n & 1][c] += value[n][c];
        const auto at = static_cast<std::size_t>((y - 4) * 3 + x - 3);
        for (std::size_t h = 0; h < 2; ++h)
          for (std::size_t c = 0; c < 3; ++c)
            EXPECT_EQ(tile.sums[(3 * h + c) * 6 + at], static_cast<float>(sum[h][c])) << s.name;
      }
  }
}

}  // namespace
}  // namespace ls::test
