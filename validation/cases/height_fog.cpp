// Fog whose density falls with height, in closed form and as a volume that is looked up: transmittance, light
// scattered once from a sun and from a lamp, light given off, white furnaces, and the same fog as a grid. The
// integrals are written here once more, by quadrature of the density.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

// Fog of extinction `sigma` at the ground, the plane y = `ground`, and `height` along y.
struct Fog {
  double sigma = 1, height = .5, ground = -.5;
  // True: the fog is times a noise of 1 everywhere, so that it is tracked with bounds of its density. The
  // noise ends at `reach` from the origin.
  bool looked_up = false;
  double reach = 1;

  double density(double y) const { return std::exp(-std::max(0., (y - ground) / height)); }
  // The density integrated from one point to another, of which only the heights and the distance matter.
  double between(double y0, double y1, double length) const {
    // Split where the ray meets the ground, so that the pieces are smooth
    const auto piece = [&](double a, double b) {
      return (b - a) * length *
             integrate([&](double u) { return density(y0 + (y1 - y0) * (a + (b - a) * u)); }, 0, 1, 400);
    };
    const double at = (ground - y0) / (y1 - y0);
    return at > 0 && at < 1 ? piece(0, at) + piece(at, 1) : piece(0, 1);
  }
  MediumIndex add(SceneBuilder& b, const Rgb& albedo, double g = 0) const {
    HeightFogVolume v;
    v.value = sigma;
    v.height = height;
    v.ground_point = {3, ground, -1};
    v.ground_normal = {0, 2, 0};
    VolumeIndex density = SceneBuilder::push<VolumeTag>(b.scene.volumes, v);
    if (looked_up) {
      NoiseVolume one;
      one.low = one.high = 1;
      one.min = {-reach, -reach, -reach};
      one.max = {reach, reach, reach};
      const VolumeIndex first = SceneBuilder::push<VolumeTag>(b.scene.volumes, one);
      density = SceneBuilder::push<VolumeTag>(b.scene.volumes, ProductVolume{first, density});
    }
    return b.heterogeneous(density, albedo, 1, g);
  }
};

// The scene with the fog in place of its medium.
SceneBuilder in_fog(SceneBuilder b, const Fog& fog, const Rgb& albedo, const Rgb& tint = {1, 1, 1}) {
  const MediumIndex made = fog.add(b, albedo);
  auto& medium = std::get<HeterogeneousMedium>(b.scene.media[made.value]);
  medium.tint = tint;
  b.scene.media[0] = medium;
  b.scene.media.resize(1);
  return b;
}

std::vector<Configuration> fog_configurations() {
  return {{false, false},
          {false, false, DistanceSampling::mis, 2},
          {false, true},
          {false, true, DistanceSampling::equiangular},
          {false, true, DistanceSampling::exponential}};
}
std::string fog_path(const Configuration& c, bool looked_up = false) {
  return (looked_up ? "/lookup/" : "/height/") + c.integrator_name();
}

// The slack of answers by quadrature, and of float32 in lengths of about 1.
constexpr double kFogSlack = 2e-6;

void fog_through(Table& t) {
  const Configuration c{};
  for (const bool looked_up : {false, true})
    // Rays from outside through the cube [-1, 1]^3, up by `rise` along their way of 2 along z
    for (const double rise : {0., 1e-7, .9, -.9}) {
      const double length = std::hypot(2., rise);
      for (const Rgb& tint : {rgb(1), Rgb{.5, 1, 2}}) {
        const Fog fog{2, .5, -.5, looked_up};
        Channels expected;
        for (std::size_t k = 0; k < 3; ++k)
          expected[k] = std::exp(-fog.sigma * tint[k] * fog.between(-rise / 2, rise / 2, length));
        t.mean(fmt::format("height-fog-through-{:g}{}{}", rise, is_grey(tint) ? "" : "-coloured",
                           fog_path(c, looked_up)),
               "7.6a", "Light straight through fog that falls with height, level and aslant.",
               [=] {
                 SceneBuilder b = in_fog(unit_cube(c, rgb(1)), fog, rgb(0), tint);
                 b.scene.shapes.clear();
                 b.container(CubeShape{}, {}, b.null(), MediumIndex{0});
                 b.environment();
                 b.look({0, -rise * 2, -4}, {0, 0, 0}, 1e-4, {0, 1, 0});
                 return b;
               },
               expected, {.slack = kFogSlack, .slow = looked_up || !is_grey(tint) || rise < 0});
      }
    }
  // Out of the fog into the sky: from the level l up at the slope s, the depth is e^-l H / s; from below the
  // ground the way to it comes first.
  for (const double y : {-1., 0.}) {
    const Fog fog{2, .5, -.5};
    const double s = std::sqrt(.5), below = std::max(0., (fog.ground - y) / s);
    const double depth = below + fog.density(y) * fog.height / s;
    t.mean(fmt::format("height-fog-into-the-sky-{:g}{}", y, fog_path(c)), "7.6a",
           "A white sky seen through fog without an end.",
           [=] {
             SceneBuilder b;
             b.scene.sensor.medium = fog.add(b, rgb(0));
             b.environment();
             b.look({0, y, 0}, {0, y + 1, 1}, 1e-4, {0, 1, 0});
             return b;
           },
           grey(std::exp(-fog.sigma * depth)), {.slack = kFogSlack, .slow = below > 0});
  }
}

// lit_cube() in fog: at the height y the ray is level, so the density is the same along it.
void fog_in_sun(Table& t) {
  const auto add = [&](const Configuration& c, bool looked_up) {
    for (const double y : {-.75, .25}) {
      const Fog fog{1.5, .5, -.5, looked_up};
      const double sigma = fog.sigma * fog.density(y);
      const double radiance =
          .8 / (4 * kPi) * -std::expm1(-2 * sigma) * std::exp(-fog.sigma * fog.between(y, 1, 1 - y));
      t.mean(fmt::format("height-fog-sun-{:g}{}", y, fog_path(c, looked_up)), "7.6f",
             "A sun from above, scattered once in fog that falls with height.",
             in_fog(lit_cube(c, rgb(1), rgb(1), y), fog, rgb(.8)), grey(radiance),
             {.slack = kFogSlack, .slow = looked_up});
    }
  };
  for (const Configuration& c : fog_configurations()) add(c, false);
  for (const bool distant : {false, true}) add({true, distant}, true);
}

// passing() in fog, seen level at y = 0, with a lamp of 1 W at the height h above the middle of the ray.
void lamp_in_fog(Table& t) {
  const auto add = [&](const Configuration& c, bool looked_up) {
    for (const bool coloured : {false, true}) {
      const Fog fog{.4, .8, -.3, looked_up, 50};
      const Rgb tint = coloured ? Rgb{.5, 1, 2} : rgb(1);
      constexpr double h = .5;
      Channels expected;
      for (std::size_t k = 0; k < 3; ++k) {
        const double sigma = fog.sigma * tint[k], here = sigma * fog.density(0);
        // As in passing_answer(): over the angle q at which the lamp sees a point at h tan q
        expected[k] = .9 * here / (16 * kPi * kPi * h) *
                      integrate(
                          [&](double q) {
                            const double z = h * std::tan(q);
                            return std::exp(-here * (z + 3) - sigma * fog.between(0, h, std::hypot(h, z)));
                          },
                          -std::atan(3 / h), std::atan(3 / h), 2000);
      }
      t.mean(fmt::format("height-fog-lamp{}{}", coloured ? "-coloured" : "", fog_path(c, looked_up)), "7.6f",
             "A lamp in fog that falls with height, scattered once.",
             [=] {
               SceneBuilder b = in_fog(passing(c, rgb(1), rgb(1)), fog, rgb(.9), tint);
               b.scene.emitters.push_back(PointEmitter{{0, h, 0}, rgb(1 / (4 * kPi))});
               return b;
             },
             expected, {.slack = kFogSlack, .slow = coloured || looked_up});
    }
  };
  for (const Configuration& c : fog_configurations()) add(c, false);
  for (const bool distant : {false, true}) add({true, distant}, true);
}

void fog_emission(Table& t) {
  for (const bool looked_up : {false, true}) {
    const Fog fog{2, .5, -.5, looked_up};
    const double depth = fog.between(-.45, .45, std::hypot(2, .9));
    t.mean("height-fog-emission" + fog_path({}, looked_up), "7.6c",
           "Light that absorbing fog gives off, by its density.",
           [=] {
             SceneBuilder b = in_fog(unit_cube({}, rgb(1)), fog, rgb(0));
             b.set_emission({0}, rgb(3), true);
             b.scene.shapes.clear();
             b.container(CubeShape{}, {}, b.null(), MediumIndex{0});
             b.look({0, -1.8, -4}, {0, 0, 0}, 1e-4, {0, 1, 0});
             return b;
           },
           grey(3 * -std::expm1(-fog.sigma * depth)), {.slack = kFogSlack, .slow = looked_up});
  }
}

void fog_furnaces(Table& t) {
  for (const bool distant : {false, true})
    for (const Rgb& tint : {rgb(1), Rgb{.3, 1, 3}}) {
      const Configuration c{false, distant};
      t.mean(fmt::format("height-fog-furnace{}{}", is_grey(tint) ? "" : "-coloured", fog_path(c)), "N03",
             "Fog that only scatters, in a white surrounding: white.",
             [=] {
               SceneBuilder b = in_fog(unit_cube(c, rgb(1)), {1.5, .6, -.4}, rgb(1), tint);
               b.scene.shapes.clear();
               b.container(SphereShape{}, {}, b.null(), MediumIndex{0});
               return furnace(b);
             },
             grey(1), {.slow = true});
    }
}

// The density at the centres of 1024 voxels of the cube's height, linear between them: off by at most
// (1/512)^2 / 8 times the second derivative, that is by 2e-6 of the density, except at the ground, where the
// kink changes the depth of a ray by as little.
void fog_as_grid(Table& t) {
  const Fog fog{3, .5, -.5};
  const auto scene = [=](bool grid) {
    return [=] {
      SceneBuilder b({32, 32});
      std::vector<float> values;
      for (int i = 0; i < 1024; ++i) values.push_back(static_cast<float>(fog.density(-1 + (i + .5) / 512)));
      const MediumIndex m = grid ? b.heterogeneous(b.grid({1, 1024, 1}, values, box({-1, -1, -1}, {1, 1, 1})),
                                                   rgb(.9), fog.sigma, .5)
                                 : fog.add(b, rgb(.9), .5);
      b.container(CubeShape{}, {}, b.null(), m);
      b.scene.emitters.push_back(DirectionalEmitter{{.3, -1, .2}, rgb(2)});
      b.environment(.3);
      b.look({3, 1.5, -4}, {0, 0, 0}, 34, {0, 1, 0});
      return b;
    };
  };
  t.same("height-fog-as-grid/height/volpath", "7.6a",
         "Fog that falls with height, and the same as a fine grid, lit by a sun and a sky.", scene(false),
         scene(true), {.slack = 1e-5, .slow = true});
}

}  // namespace

void add_height_fog(Table& t) {
  fog_through(t);
  fog_in_sun(t);
  lamp_in_fog(t);
  fog_emission(t);
  fog_furnaces(t);
  fog_as_grid(t);
}

}  // namespace ls::cases
