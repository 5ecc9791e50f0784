// The integrator `volpath_distant_mis` in all its settings, and `volpath` with points on the camera's
// segments, with every kind of light: the same answers as everything else here.
#include <cmath>

#include "tests/statistical/case.h"
#include "tests/support/sky_builder.h"
#include "validation/fixtures/fixtures.h"

namespace ls::test {
namespace {

constexpr int kOnce = 2;  // paths of two segments, the light's included: one scattering

struct Choice {
  const char* name;
  DistanceSampling distance;
  MisHeuristic heuristic = MisHeuristic::power;
};
constexpr Choice kExponential{"exponential", DistanceSampling::exponential};
constexpr Choice kEquiangular{"equiangular", DistanceSampling::equiangular};
constexpr Choice kPower{"mis_power", DistanceSampling::mis};
constexpr Choice kBalance{"mis_balance", DistanceSampling::mis, MisHeuristic::balance};

class Adder {
 public:
  explicit Adder(std::vector<Case>& cases) : cases_(cases) {}
  // The exponential alone comes near a light by chance only: its interval is wider, as it should be.
  void add(const std::string& name, const SceneBuilder& builder, const std::array<double, 3>& expected,
           std::uint64_t spp, std::initializer_list<Choice> choices, double band = .005) {
    for (const Choice& choice : choices) {
      Case c{"distant_" + name + "_" + choice.name, builder, expected, spp};
      IntegratorSettings& i = c.builder.scene.integrator;
      i.name = "volpath_distant_mis";
      i.distance = choice.distance;
      i.heuristic = choice.heuristic;
      c.band = choice.distance == DistanceSampling::exponential ? .02 : band;
      cases_.push_back(std::move(c));
    }
    for (const int points : {1, 5}) {
      Case c{"camera_points_" + std::to_string(points) + "_" + name, builder, expected, spp};
      c.builder.scene.integrator.camera_points = points;
      c.band = band;
      cases_.push_back(std::move(c));
    }
  }

 private:
  std::vector<Case>& cases_;
};

using cases::integrate;

// Of 1 W at distance h from the ray's middle: albedo / (4 pi) int sigma e^(-sigma (t + 3 + d)) / (4 pi d^2)
// dt.
double point_answer(double h, double sigma, double albedo, double end) {
  return integrate(
      [&](double t) {
        const double d2 = h * h + t * t;
        return albedo * sigma / (16 * kPi * kPi) * std::exp(-sigma * (t + 3 + std::sqrt(d2))) / d2;
      },
      -3, end, 20000);
}

// Where nothing ends the ray there are no angles to choose: the exponential alone, whose samples near the
// light are few.
void without_end(Adder& a) {
  constexpr double kHeight = .5;
  const Rgb sigma{.5, 1, 2}, albedo{1, .8, .5};
  SceneBuilder builder;
  builder.scene.sensor.medium = builder.homogeneous(sigma, albedo);
  builder.scene.integrator.max_depth = kOnce;
  builder.look({0, 0, -3}, {0, 0, 3}, 1e-4, {0, 1, 0});
  builder.scene.emitters.push_back(PointEmitter{{kHeight, 0, 0}, rgb(1 / (4 * kPi))});
  std::array<double, 3> expected;
  for (std::size_t c = 0; c < 3; ++c) expected[c] = point_answer(kHeight, sigma[c], albedo[c], 60);
  a.add("point_without_end", builder, expected, 4096, {kPower}, .02);
}

std::vector<float> patchy(std::size_t n) {
  std::vector<float> v(n);
  for (std::size_t i = 0; i < n; ++i) v[i] = i % 5 < 2 ? static_cast<float>(i % 11) / 4 : 0.f;
  return v;
}

// Where light comes from everywhere and nothing absorbs, everything is as bright as the light, however often
// it is scattered: from surroundings, as a constant and as a map, and from walls that shine.
void furnaces(Adder& a) {
  const auto filled = [](SceneBuilder& builder, bool grid) {
    if (grid) {
      const VolumeIndex v = builder.grid({12, 9, 7}, patchy(12 * 9 * 7), translate({-1, -1, -1}) * scale(2));
      builder.container(CubeShape{}, {}, builder.null(), builder.heterogeneous(v, rgb(1), 2, -.5));
    } else {
      builder.container(SphereShape{}, {}, builder.null(), builder.homogeneous({1, 2.5, 4}, rgb(1), .6));
    }
    builder.look({.4, -3, .7}, {0, 0, 0}, 30);
  };
  {
    SceneBuilder builder;
    filled(builder, true);
    builder.environment();
    a.add("furnace_constant_grid", builder, grey(1), 256, {kPower});
  }
  for (const bool grid : {false, true}) {
    SceneBuilder builder;
    filled(builder, grid);
    add_sky(builder, SkyImage(16, 9, 1), rotate_x(30) * rotate_y(20));
    a.add(grid ? "furnace_map_grid" : "furnace_map_chromatic_ball", builder, grey(1), 2048,
          {kEquiangular, kPower}, .01);
  }
  for (const bool grid : {false, true}) {
    SceneBuilder builder;
    filled(builder, grid);
    Shape& walls = builder.shape(CubeShape{}, scale(4), builder.diffuse(0));
    walls.flip_normals = true;
    walls.emitter = AreaEmitter{builder.texture(rgb(1))};
    a.add(grid ? "furnace_walls_grid" : "furnace_walls_chromatic_ball", builder, grey(1), 2048,
          {kExponential, kEquiangular, kPower}, .01);
  }
}

}  // namespace

void add_distant(std::vector<Case>& cases) {
  Adder a(cases);
  without_end(a);
  furnaces(a);
}

}  // namespace ls::test
