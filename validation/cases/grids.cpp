// Media given by grids: majorants far above the density, single dense voxels, rays along the faces of voxels,
// and invalid densities.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

std::size_t at(const std::array<int, 3>& n, int x, int y, int z) {
  return static_cast<std::size_t>((z * n[1] + y) * n[0] + x);
}

// The unit cube filled with a purely absorbing grid, and a ray that goes through the points `from` and `to`.
// The ray is a camera ray that ends at a white environment behind the cube (this tests free flights) or, with
// `by_shadow`, a shadow ray from a white disk behind the cube to the sun in front of it.
SceneBuilder seen_through(const std::array<int, 3>& n, const std::vector<float>& values, double sigma,
                          const Vec3& from, const Vec3& to, bool by_shadow) {
  SceneBuilder builder;
  const BsdfIndex null = builder.null();
  builder.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), null,
                    builder.heterogeneous(builder.grid(n, values, Transform{}), rgb(0), sigma));
  const Vec3 d = unit({to[0] - from[0], to[1] - from[1], to[2] - from[2]});
  const Vec3 up = std::abs(d[2]) < .9 ? Vec3{0, 0, 1} : Vec3{0, 1, 0};
  const auto along = [&](double s) -> Vec3 {
    return {from[0] + s * d[0], from[1] + s * d[1], from[2] + s * d[2]};
  };
  if (by_shadow) {
    // A small white disk behind the cube. The camera sees it from the side, past the cube; the sun lights it
    // through the cube.
    builder.shape(DiskShape{}, look_at(along(4), along(0), up) * scale(.01), builder.diffuse(.5));
    builder.scene.emitters.push_back(DirectionalEmitter{d, rgb(1)});
    builder.scene.integrator.max_depth = kOnce;
    const Vec3 aside = unit(cross(d, up)), p = along(3.9);
    builder.look({p[0] + .4 * aside[0], p[1] + .4 * aside[1], p[2] + .4 * aside[2]}, along(4), 1e-3, up);
  } else {
    builder.environment();
    builder.look(along(-2), along(0), 1e-5, up);
  }
  return builder;
}
// Returns the radiance that the camera sees if the ray has this transmittance: that of the white environment,
// or (`by_shadow`) that of the disk.
double shown(double transmittance, bool by_shadow) {
  return by_shadow ? transmittance * .5 / kPi : transmittance;
}
const char* way_of(bool by_shadow) { return by_shadow ? "/grid/shadow" : "/grid/volpath"; }

// Returns the integral of the trilinear density along a line within the unit cube, from one of its faces to
// another. The line is cut where it crosses planes of voxel centres. On each piece the density is a cubic
// polynomial, so Simpson's rule is exact.
double depth_along(const std::array<int, 3>& n, const std::vector<float>& values, const Vec3& from,
                   const Vec3& to) {
  const auto value = [&](double s) {
    int i[3][2];
    double f[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = (from[k] + s * (to[k] - from[k])) * n[k] - .5, cell = std::floor(x);
      f[k] = x - cell;
      for (int e = 0; e < 2; ++e) i[k][e] = std::clamp(static_cast<int>(cell) + e, 0, n[k] - 1);
    }
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
      const int a = c & 1, b = c >> 1 & 1, e = c >> 2;
      sum += (a ? f[0] : 1 - f[0]) * (b ? f[1] : 1 - f[1]) * (e ? f[2] : 1 - f[2]) *
             double{values[at(n, i[0][a], i[1][b], i[2][e])]};
    }
    return sum;
  };
  std::vector<double> cuts{0, 1};
  for (std::size_t k = 0; k < 3; ++k)
    for (int c = 0; c <= n[k]; ++c) {
      const double s = ((c + .5) / n[k] - from[k]) / (to[k] - from[k]);
      if (s > 0 && s < 1) cuts.push_back(s);
    }
  std::sort(cuts.begin(), cuts.end());
  double sum = 0, length = 0;
  for (std::size_t k = 0; k < 3; ++k) length += (to[k] - from[k]) * (to[k] - from[k]);
  for (std::size_t c = 1; c < cuts.size(); ++c) sum += integrate(value, cuts[c - 1], cuts[c], 2);
  return sum * std::sqrt(length);
}

void bounds_too_high(Table& t) {
  // A grid with sixteen voxels per side, all of density 1 except one voxel beside the ray, which is `times`
  // times denser. The ray crosses macro cells that contain this voxel, so its density is their majorant.
  for (const bool shadow : {false, true}) {
    for (const double times : {1., 10., 1e4, 1e6}) {
      t.mean(
          fmt::format("N08-bound-{:g}-times-too-high{}", times, way_of(shadow)), "N8",
          "One voxel beside the ray makes the bound of its cells too high: what gets through is the same.",
          [=] {
            std::vector<float> values(16 * 16 * 16, 1);
            values[at({16, 16, 16}, 5, 5, 7)] = static_cast<float>(times);
            return seen_through({16, 16, 16}, values, .5, {0, .5 + 1. / 32, .5 + 1. / 32},
                                {1, .5 + 1. / 32, .5 + 1. / 32}, shadow);
          },
          grey(shown(std::exp(-.5), shadow)));
    }
  }
  for (const float value : {.1f, .3f, 7e-5f}) {
    t.exact(fmt::format("N09-equal-values-{:g}/grid/volpath", value), "N9",
            "Voxels of one value: interpolation must not exceed the bound, nor scatter lose anything.",
            [value](const Bench& b) {
              SceneBuilder builder;
              builder.container(CubeShape{}, {}, builder.null(),
                                builder.heterogeneous(builder.grid({9, 7, 5}, std::vector<float>(315, value),
                                                                   box({-1, -1, -1}, {1, 1, 1})),
                                                      rgb(1), 2 / value));
              return every_value(b, furnace(builder), 64, grey(1), 0);
            });
  }
}

void hot_voxels(Table& t) {
  const double centre = 8.5 / 16;
  const auto ray = [=](double rho, double sigma, double y, bool shadow) {
    const std::array<int, 3> n{16, 16, 16};
    std::vector<float> values(16 * 16 * 16, 0);
    values[at(n, 8, 8, 8)] = static_cast<float>(rho);
    return seen_through(n, values, sigma, {0, y, centre}, {1, y, centre}, shadow);
  };
  for (const bool shadow : {false, true}) {
    for (const double rho : {8., 1e3, 1e6}) {
      t.mean(
          fmt::format("N10-hot-voxel-{:g}{}", rho, way_of(shadow)), "N10 7.6a",
          "One voxel among empty ones, through its middle: the tent's area is rho h.",
          [=] { return ray(rho, 8 / rho, centre, shadow); }, grey(shown(std::exp(-.5), shadow)));
      t.mean(
          fmt::format("N10-past-a-hot-voxel-{:g}{}", rho, way_of(shadow)), "N10",
          "The ray passes two voxels beside it: nothing is in the way.",
          [=] { return ray(rho, 1, centre + 2. / 16, shadow); }, grey(shown(1, shadow)));
    }
  }
}

// Thin fog with a dense wall across it. The camera ray stays three voxels away from the wall, and the light
// that reaches the ray does not cross the wall, either. But macro cells on the ray contain part of the wall:
// if the mean density of these cells were used, no light would get through. The light comes from a lamp of
// intensity 1 in the fog and is scattered once. With sigma the extinction of the fog, t the position on the
// ray and r its distance from the lamp, the answer is the integral over the ray of
// sigma / (4 pi) e^-(sigma (t + r)) / r^2.
void beside_a_wall(Table& t) {
  constexpr int n = 33, wall = 16;
  constexpr double sigma = .5, density = 1e4;
  const Vec3 lamp{.9, .62, .5};
  const double y = .6, z = .47;
  const double radiance = integrate(
      [&](double x) {
        const double r2 =
            (x - lamp[0]) * (x - lamp[0]) + (y - lamp[1]) * (y - lamp[1]) + (z - lamp[2]) * (z - lamp[2]);
        return sigma / (4 * kPi) * std::exp(-sigma * (x + std::sqrt(r2))) / r2;
      },
      0, 1, 20000);
  std::vector<float> values(n * n * n, 1);
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < n; ++i) values[at({n, n, n}, i, wall, k)] = density;
  for (const Configuration& configuration : all_configurations()) {
    if (!configuration.grid) continue;
    t.mean(
        "N10-beside-a-hot-wall" + configuration.name(), "N10 N32",
        "Fog beside a wall of 1e4 times its density, which no ray meets: light of a lamp, scattered once.",
        [=] {
          SceneBuilder builder;
          configuration.choose(builder);
          builder.container(
              CubeShape{}, translate({.5, .5, .5}) * scale(.5), builder.null(),
              builder.heterogeneous(builder.grid({n, n, n}, values, Transform{}), rgb(1), sigma));
          builder.scene.emitters.push_back(PointEmitter{lamp, rgb(1)});
          builder.scene.integrator.max_depth = kOnce;
          builder.look({-2, y, z}, {0, y, z}, 1e-4);
          return builder;
        },
        grey(radiance));
  }
}

void along_faces(Table& t) {
  struct Line {
    const char* name;
    Vec3 from, to;
  };
  const std::array<int, 3> n{8, 8, 8};
  const std::vector<float> values = patchy(512, 12);
  const Line lines[] = {{"axis-through-centres", {0, .5625, .4375}, {1, .5625, .4375}},
                        {"axis-along-edges", {.5, .5, 0}, {.5, .5, 1}},
                        {"axis-backwards", {.25, 1, .5}, {.25, 0, .5}},
                        {"in-a-face", {0, .1, .5}, {1, .9, .5}},
                        {"diagonal-through-corners", {0, 0, 0}, {1, 1, 1}},
                        {"all-but-an-axis", {0, .5, .5}, {1, .5 + 1e-7, .5 - 1e-7}}};
  for (const Line& line : lines) {
    for (const bool shadow : {false, true}) {
      // The mean density along each of these lines is between 0.4 and 0.7, so the transmittance is far from 0
      // and from 1.
      const double tau = depth_along(n, values, line.from, line.to);
      t.mean(
          fmt::format("N12-{}{}", line.name, way_of(shadow)), "N12 N13",
          "A ray along an axis, a face or a diagonal of random voxels, against the exact integral.",
          [=] { return seen_through(n, values, 1, line.from, line.to, shadow); },
          grey(shown(std::exp(-tau), shadow)));
    }
  }
  // The density x y z over the unit cube, given by its values at the eight corners. On the diagonal, whose
  // length is sqrt(3), the density is t^3 at the share t of that length, so its integral is sqrt(3) / 4.
  for (const bool shadow : {false, true}) {
    t.mean(
        std::string("N12-corner-grid-diagonal") + way_of(shadow), "N12 7.6a",
        "The product of the coordinates along the diagonal: sqrt(3) / 4.",
        [=] {
          SceneBuilder builder =
              seen_through({2, 2, 2}, {0, 0, 0, 0, 0, 0, 0, 1}, 1, {0, 0, 0}, {1, 1, 1}, shadow);
          for (Volume& v : builder.scene.volumes)
            if (auto* g = std::get_if<GridVolume>(&v)) g->node_centred = true;
          return builder;
        },
        grey(shown(std::exp(-std::sqrt(3.) / 4), shadow)));
  }
}

// Returns the scene with `pieces` - 1 additional surfaces, which have a null (pass-through) BSDF and cut a
// unit cube of its first medium into pieces along x.
SceneBuilder cut(SceneBuilder builder, int pieces) {
  const BsdfIndex null = builder.null();
  for (int i = 1; i < pieces; ++i)
    builder
        .container(RectangleShape{}, translate({1. * i / pieces, .5, .5}) * rotate_y(90) * scale(.5), null,
                   {0})
        .exterior = MediumIndex{0};
  return builder;
}

void cut_in_pieces(Table& t) {
  for (const Configuration& configuration : both_media()) {
    for (const int pieces : {1, 10}) {
      t.mean(
          fmt::format("N13-in-{}-pieces{}", pieces, configuration.name()), "N13 N42 7.7",
          "A ray cut by boundaries that change nothing: the same depth, by flights.",
          [=] { return in_white(cut(unit_cube(configuration, rgb(.25)), pieces)); }, grey(std::exp(-.25)));
    }
    for (const int pieces : {10, 1000}) {
      // The length of each piece is a difference of float32 positions. A piece begins at the position where
      // the previous one ends, so errors of positions do not add up. But each length is rounded by an ulp of
      // the scene's size, and these errors add up over the pieces.
      const double tolerance = 2e-6 + pieces * 0x1p-24;
      t.exact(fmt::format("N13-light-of-{}-pieces{}", pieces, configuration.name()), "N13 N42",
              "Light given off without extinction, summed up over pieces: the whole length.",
              [=](const Bench& b) {
                SceneBuilder builder = unit_cube(configuration, rgb(0));
                builder.set_emission(MediumIndex{0}, rgb(1));
                return every_value(b, cut(builder, pieces), 4, grey(1), tolerance);
              });
      t.exact(
          fmt::format("N13-shadow-through-{}-pieces{}", pieces, configuration.name()), "N13 N42",
          "A shadow ray cut by boundaries that change nothing: e^-1, exactly.", [=](const Bench& b) {
            SceneBuilder builder = lit_floor();
            configuration.choose(builder);
            const MediumIndex m =
                configuration.medium(builder, rgb(1), rgb(0), 0, box({-1, -1, 1}, {1, 1, 2}));
            builder.container(CubeShape{}, translate({0, 0, 1.5}) * scale(1, 1, .5), builder.null(), m);
            const BsdfIndex null = builder.null();
            for (int i = 1; i < pieces; ++i)
              builder.container(RectangleShape{}, translate({0, 0, 1 + 1. * i / pieces}), null, m).exterior =
                  m;
            return every_value(b, builder, 4, grey(std::exp(-1.) / (2 * kPi)), tolerance);
          });
    }
  }
}

// Voxels of 0.25 x 25 x 0.0025 units, so the longest side is ten thousand times the shortest. A ray along
// each axis must have the right optical depth.
void long_voxels(Table& t) {
  const std::array<int, 3> n{4, 4, 4};
  std::vector<float> values(64);
  for (std::size_t i = 0; i < 64; ++i) values[i] = static_cast<float>((i * 7919) % 13) / 6;
  const Vec3 half{.5, 50, .005};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Vec3 from{.5, .5, .5}, to = from;
    from[axis] = 0;
    to[axis] = 1;
    t.mean(fmt::format("N65-voxels-1-to-1e4-along-{}/grid/volpath", "xyz"[axis]), "N65",
           "A grid whose voxels are 100 units long and a hundredth wide, along each axis.",
           [=] {
             SceneBuilder builder;
             const BsdfIndex null = builder.null();
             const Transform place = box({-half[0], -half[1], -half[2]}, half);
             builder.container(
                 CubeShape{}, scale(half[0], half[1], half[2]), null,
                 builder.heterogeneous(builder.grid(n, values, place), rgb(0), 1 / (2 * half[axis])));
             builder.environment();
             Vec3 eye{0, 0, 0};
             eye[axis] = -2 * half[axis];
             builder.look(eye, {0, 0, 0}, 1e-5, axis == 2 ? Vec3{0, 1, 0} : Vec3{0, 0, 1});
             return builder;
           },
           grey(std::exp(-depth_along(n, values, from, to))), {.slack = 1e-5});
  }
}

SceneBuilder with_voxel(float value, double sigma = 1) {
  std::vector<float> values(4 * 4 * 4, 1);
  values[21] = value;
  SceneBuilder builder;
  builder.container(
      CubeShape{}, {}, builder.null(),
      builder.heterogeneous(builder.grid({4, 4, 4}, values, box({-1, -1, -1}, {1, 1, 1})), rgb(.5), sigma));
  return furnace(builder);
}

void no_densities(Table& t) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  for (const auto& [name, value] : {std::pair{"nan", std::nanf("")}, {"inf", kInf}, {"minus-inf", -kInf}}) {
    t.exact(fmt::format("N14-{}/grid", name), "N14",
            "A density that is no number: the grid is refused by name.",
            [value](const Bench& b) { return refused(b, with_voxel(value), {"grid.vol"}); });
  }
  t.exact("N14-1e38/grid", "N14", "Densities whose product with sigma is beyond float32: refused.",
          [](const Bench& b) { return refused(b, with_voxel(1e38f, 1e3), {"extinction"}); });
  for (const float value : {-.5f, -1e30f, -0.f}) {
    t.exact(fmt::format("N14-negative{:g}/grid/volpath", value), "N14",
            "A negative density renders as 0, bit for bit.",
            [value](const Bench& b) { return same_bits(b, with_voxel(value), with_voxel(0), 16); });
  }
  t.exact("N14-albedo-above-1/grid/volpath", "N14", "Albedos of 1.5 and 40 scatter as 1 does, bit for bit.",
          [](const Bench& b) {
            const auto with_albedo = [](float one, float other) {
              SceneBuilder builder = with_voxel(1);
              std::get<HeterogeneousMedium>(builder.scene.media[0]).albedo =
                  builder.grid({2, 1, 1}, {one, other}, box({-1, -1, -1}, {1, 1, 1}));
              std::get<ConstantEmitter>(builder.scene.emitters[0]).radiance = {1, 2, 4};
              return builder;
            };
            return same_bits(b, with_albedo(1.5f, 40), with_albedo(1, 1), 16);
          });
  t.exact("N14-negatives-are-counted/grid", "N14", "The report counts the one negative density.",
          [](const Bench& b) -> Figure {
            const auto p = shoot(with_voxel(-.5f), 2, b);
            if (!p) return {.why = p.error().message};
            return {1, static_cast<double>(p->clamped_inputs), 0, {}, 0};
          });
  // All densities are 1e-40 or 1e-38, denormal float32 numbers. With the scale 1e20 the optical depth of the
  // cube is 2e-20 or 2e-18. Denormal values must neither produce invalid results nor be slow.
  for (const float value : {1e-40f, 1e-38f}) {
    t.exact(fmt::format("N58-denormal-{:g}/grid/volpath", value), "N14 N58",
            "Densities around the smallest float32: nothing is in the way, and nothing goes wrong.",
            [value](const Bench& b) {
              SceneBuilder builder;
              builder.container(CubeShape{}, {}, builder.null(),
                                builder.heterogeneous(builder.grid({8, 8, 8}, std::vector<float>(512, value),
                                                                   box({-1, -1, -1}, {1, 1, 1})),
                                                      rgb(.5), 1e20));
              return every_value(b, furnace(builder), 64, grey(1), 0);
            });
  }
}

// A medium without extinction in red and almost opaque in blue. A free flight is sampled by the extinction of
// one channel, the hero, which is chosen at random; the weight of the path uses the pdfs of all channels.
void heroes(Table& t) {
  for (const Configuration& configuration : all_configurations()) {
    t.mean("N15-hero-without-extinction" + configuration.name(), "N15 7.6a",
           "Extinction 0, 1 and 16 in the channels: none starves the others.",
           [=] {
             return in_white(unit_cube(configuration, {0, 1, 16}));
           },
           {1, std::exp(-1.), std::exp(-16.)});
  }
}

}  // namespace

void add_grids(Table& t) {
  bounds_too_high(t);
  hot_voxels(t);
  beside_a_wall(t);
  along_faces(t);
  cut_in_pieces(t);
  long_voxels(t);
  no_densities(t);
  heroes(t);
}

}  // namespace ls::cases
