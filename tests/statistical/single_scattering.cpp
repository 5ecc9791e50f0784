// Light scattered once, against closed forms and quadrature.
#include <cmath>

#include "tests/statistical/case.h"

namespace ls::test {
namespace {

// Paths of two segments, the light's included: one scattering.
constexpr int kOnce = 2;

// Composite Simpson; n even.
template <class F>
double integrate(F f, double a, double b, int n) {
  const double h = (b - a) / n;
  double sum = f(a) + f(b);
  for (int i = 1; i < n; ++i) sum += (i % 2 ? 4 : 2) * f(a + i * h);
  return sum * h / 3;
}

// Cube [-1, 1]^3, light straight down its y axis, ray along z at height y (STABILITY 7.6f).
SceneKit lit_cube(double y, const Vec3& at = {0, 0, 0}) {
  SceneKit kit;
  kit.container(CubeShape{}, translate(at), kit.null(), kit.homogeneous(rgb(1), rgb(1)));
  kit.scene.emitters.push_back(DirectionalEmitter{{0, -1, 0}, rgb(1)});
  kit.scene.integrator.max_depth = kOnce;
  kit.look({at[0], at[1] + y, at[2] - 3}, {at[0], at[1] + y, at[2]}, 1e-3, {0, 1, 0});
  return kit;
}

void directional(std::vector<Case>& cases) {
  cases.push_back({"single_cube_low", lit_cube(-.9), grey(.0102914924), 1024});
  cases.push_back({"single_cube_middle", lit_cube(0), grey(.0253129867), 1024});
  cases.push_back({"single_cube_high", lit_cube(.9), grey(.0622599010), 1024});
  cases.push_back({"single_cube_moved_1e5", lit_cube(0, {1e5, -1e5, 1e5}), grey(.0253129867), 1024});
  {
    SceneKit kit;  // the same medium as a constant grid of half the density and twice the scale
    const Transform box = translate({-1, -1, -1}) * scale(2);
    const VolumeIndex v = kit.grid({3, 4, 5}, std::vector<float>(60, .5f), box);
    kit.container(CubeShape{}, {}, kit.null(), kit.heterogeneous(v, rgb(1), 2));
    kit.scene.emitters.push_back(DirectionalEmitter{{0, -1, 0}, rgb(1)});
    kit.scene.integrator.max_depth = kOnce;
    kit.look({0, 0, -3}, {0, 0, 0}, 1e-3, {0, 1, 0});
    cases.push_back({"single_cube_grid", kit, grey(.0253129867), 1024});
  }
  {
    // Channels of their own: sigma_t (.5, 1, 4), albedo (1, .5, .25); L = E/(4 pi) a (1 - e^-2s) e^-s.
    SceneKit kit = lit_cube(0);
    const Rgb s{.5, 1, 4}, a{1, .5, .25};
    kit.scene.media[0] = HomogeneousMedium{s, a, 1, {0}};
    Case c{"single_cube_chromatic", kit, {}, 8192};
    for (std::size_t k = 0; k < 3; ++k)
      c.expected[k] = a[k] * -std::expm1(-2 * s[k]) * std::exp(-s[k]) / (4 * kPi);
    cases.push_back(c);
  }
}

// A ray of length 6 whose middle passes a light at distance h, in an endless medium that scatters all; a
// black plate ends it.
SceneKit passing(double sigma) {
  SceneKit kit;
  const MediumIndex m = kit.homogeneous(rgb(sigma), rgb(1));
  kit.shape(RectangleShape{}, translate({0, 0, 3}) * scale(4) * rotate_x(180), kit.diffuse(0));
  kit.scene.sensor.medium = m;
  kit.scene.integrator.max_depth = kOnce;
  kit.look({0, 0, -3}, {0, 0, 3}, 1e-4, {0, 1, 0});
  return kit;
}

void point(std::vector<Case>& cases) {
  const auto add = [&](const char* name, double h, double sigma, double expected) {
    SceneKit kit = passing(sigma);
    kit.scene.emitters.push_back(PointEmitter{{h, 0, 0}, rgb(1 / (4 * kPi))});  // 1 W
    cases.push_back({name, kit, grey(expected), 1024});
  };
  add("single_point_h_half", .5, 1, 9.8318359e-4);
  add("single_point_h_hundredth", .01, 1, .0957677790708632);
  add("single_point_thin", 1, .1, .00102117618);
}

// A sphere of radiance 1 and radius r at distance h from the ray: the mean over its solid angle of what gets
// to each point, by quadrature over the cosine to its centre.
double sphere_answer(double h, double r, double sigma) {
  const auto arriving = [&](double t) {
    const double d2 = h * h + t * t, d = std::sqrt(d2), cos_max = std::sqrt(1 - r * r / d2);
    // Distance to the sphere at cosine c; c = cos_max + (1 - cos_max)(1 - v^2) takes the root out of the rim.
    const auto f = [&](double v) {
      const double c = cos_max + (1 - cos_max) * (1 - v * v), s2 = 1 - c * c;
      const double reach = d * c - std::sqrt(std::max(0., r * r - d2 * s2));
      return std::exp(-sigma * reach) * 2 * v * (1 - cos_max);
    };
    return 2 * kPi * integrate(f, 0, 1, 200);
  };
  return integrate([&](double t) { return sigma * std::exp(-sigma * (t + 3)) / (4 * kPi) * arriving(t); }, -3,
                   3, 6000);
}
// A square light of side 2a, facing the ray at distance h.
double square_answer(double h, double a, double sigma) {
  const auto arriving = [&](double t) {
    return integrate(
        [&](double z) {
          return integrate(
              [&](double y) {
                const double d2 = h * h + y * y + (z - t) * (z - t), d = std::sqrt(d2);
                return h / d / d2 * std::exp(-sigma * d);
              },
              -a, a, 80);
        },
        -a, a, 80);
  };
  return integrate([&](double t) { return sigma * std::exp(-sigma * (t + 3)) / (4 * kPi) * arriving(t); }, -3,
                   3, 1200);
}

void area(std::vector<Case>& cases) {
  const auto light = [](SceneKit& kit, const Geometry& g, const Transform& t) {
    const TextureIndex one = kit.texture(rgb(1));
    const BsdfIndex black = kit.diffuse(0);
    kit.shape(g, t, black).emitter = AreaEmitter{one};
  };
  for (const bool grid : {false, true}) {
    constexpr double kHeight = .5, kRadius = .3, kSigma = .7;
    SceneKit kit = passing(kSigma);
    if (grid) {
      const VolumeIndex v =
          kit.grid({2, 2, 2}, std::vector<float>(8, 1), translate({-5, -5, -5}) * scale(10));
      const MediumIndex m = kit.heterogeneous(v, rgb(1), kSigma);
      kit.scene.sensor.medium = m;
    }
    light(kit, SphereShape{}, translate({kHeight, 0, 0}) * scale(kRadius));
    cases.push_back({grid ? "single_sphere_light_grid" : "single_sphere_light", kit,
                     grey(sphere_answer(kHeight, kRadius, kSigma)), 2048});
  }
  {
    constexpr double kHeight = .3, kSide = .5, kSigma = .7;
    SceneKit kit = passing(kSigma);
    light(kit, RectangleShape{}, translate({kHeight, 0, 0}) * rotate_y(-90) * scale(kSide));
    cases.push_back({"single_square_light", kit, grey(square_answer(kHeight, kSide, kSigma)), 2048});
  }
}

}  // namespace

void add_single_scattering(std::vector<Case>& cases) {
  directional(cases);
  point(cases);
  area(cases);
}

}  // namespace ls::test
