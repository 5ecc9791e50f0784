// Phase functions other than Henyey-Greenstein's: light that is scattered once by 0, 90 and 180 degrees and
// from a lamp beside the ray, and white furnaces. What they are at an angle is written here once more, from
// the papers.
#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

using AtCosine = std::function<Channels(double)>;  // [1/sr]
struct Kind {
  std::string name;
  std::function<PhaseIndex(SceneBuilder&)> add;
  AtCosine value;
  bool ends_forwards = true;  // false: infinite straight on
};

PhaseIndex put(SceneBuilder& b, const Phase& p) { return SceneBuilder::push<PhaseTag>(b.scene.phases, p); }

double hg(double g, double c) { return (1 - g * g) / (4 * kPi) / std::pow(1 + g * g - 2 * g * c, 1.5); }
double draine(double g, double alpha, double c) {
  return hg(g, c) * (1 + alpha * c * c) / (1 + alpha * (1 + 2 * g * g) / 3);
}
// Jendersie and d'Eon 2023, equations 7 to 10
double droplets(double d, double c) {
  const double w = std::exp(-.599085 / (d - .641583) - .665888);
  return (1 - w) * hg(std::exp(-.0990567 / (d - 1.67154)), c) +
         w * draine(std::exp(-2.20679 / (d + 3.91029) - .428934), std::exp(3.62489 - 8.29288 / (d + 5.52825)),
                    c);
}
// Fournier and Jonasz 1999, with the slope nu that gives this backscatter
double fournier_forand(double backscatter, double n, double c) {
  const double s2 = (1 - c) / 2, k = 4 / (3 * (n - 1) * (n - 1)), d = k * s2, d180 = k, d90 = k / 2;
  const double nu = -std::log(1 + 2 * backscatter * (d90 - 1)) / std::log(d90);
  const double dn = std::pow(d, nu), b = std::pow(d180, nu);
  return (nu * (1 - d) - (1 - dn) + (d * (1 - dn) - nu * (1 - d)) / s2) / (4 * kPi * (1 - d) * (1 - d) * dn) +
         (1 - b) / (16 * kPi * (d180 - 1) * b) * (3 * c * c - 1);
}
// Values at cosines evenly from -1 to 1
double table(const std::vector<double>& v, double c) {
  const double h = 2. / static_cast<double>(v.size() - 1);
  double whole = 0;
  for (std::size_t i = 1; i < v.size(); ++i) whole += kPi * h * (v[i - 1] + v[i]);
  const auto i = std::min(static_cast<std::size_t>((c + 1) / h), v.size() - 2);
  const double f = (c + 1) / h - static_cast<double>(i);
  return ((1 - f) * v[i] + f * v[i + 1]) / whole;
}

std::vector<Kind> kinds() {
  const std::vector<double> grey_table{3, 1, 2, 0, 5}, red{1, 2, 3}, green{6, 2, 1}, blue{.5, 4, .25};
  const auto blend = [](SceneBuilder& b, VolumeIndex weight) {
    const PhaseIndex first = put(b, RayleighPhase{}), second = put(b, HgPhase{.3});
    return put(b, BlendPhase{weight, first, second});
  };
  const auto quarter = [](double c) { return grey(.75 * 3 / (16 * kPi) * (1 + c * c) + .25 * hg(.3, c)); };
  return {
      {"rayleigh", [](SceneBuilder& b) { return put(b, RayleighPhase{}); },
       [](double c) { return grey(3 / (16 * kPi) * (1 + c * c)); }},
      {"draine",
       [](SceneBuilder& b) {
         return put(b, DrainePhase{.7, 2});
       },
       [](double c) { return grey(draine(.7, 2, c)); }},
      {"droplets", [](SceneBuilder& b) { return put(b, DropletsPhase{12}); },
       [](double c) { return grey(droplets(12, c)); }},
      {"fournier-forand",
       [](SceneBuilder& b) {
         return put(b, FournierForandPhase{.1, 1.33});
       },
       [](double c) { return grey(fournier_forand(.1, 1.33, c)); }, false},
      {"table",
       [=](SceneBuilder& b) {
         return put(b, TabulatedPhase{grey_table, {}, {}, {}, {}, {}});
       },
       [=](double c) { return grey(table(grey_table, c)); }},
      {"table-of-colours",
       [=](SceneBuilder& b) {
         return put(b, TabulatedPhase{{}, red, green, blue, {}, {}});
       },
       [=](double c) {
         return Channels{table(red, c), table(green, c), table(blue, c)};
       }},
      {"blend", [=](SceneBuilder& b) { return blend(b, b.constant(rgb(.25))); }, quarter},
      // The grid's weight is y / 2 + 1 / 4 between the middles of its two voxels, and 1/4 at y = 0, where
      // rays are looked at.
      {"blend-by-grid",
       [=](SceneBuilder& b) {
         return blend(b, b.grid({1, 2, 1}, {0, .5}, translate({-1, -1, -1}) * scale(2)));
       },
       quarter},
  };
}

SceneBuilder with_phase(SceneBuilder builder, const Kind& kind) {
  const PhaseIndex phase = kind.add(builder);
  for (auto& medium : builder.scene.media) std::visit([&](auto& m) { m.phase = phase; }, medium);
  return builder;
}

Channels times(const Channels& c, double k) { return {c[0] * k, c[1] * k, c[2] * k}; }

// The slack: values in float32 of directions in float32.
constexpr double kFloats = 1e-6;

void once(Table& t, const Kind& kind, const Configuration& configuration) {
  const auto add = [&](const char* angle, SceneBuilder builder, const Channels& expected, bool slow) {
    t.mean(fmt::format("phase-{}-{}{}", kind.name, angle, configuration.name()), "N18 N21",
           fmt::format("Light scattered once by {} degrees: the phase function there.", angle),
           with_phase(std::move(builder), kind), expected, {.slack = kFloats, .slow = slow});
  };
  add("90", lit_cube(configuration, rgb(1), rgb(1)), times(kind.value(0), 4 * kPi * lit_cube_answer(1, 1)),
      false);
  // head_on() has its cube in [0, 1]^3, with rays at y = 1/2
  if (kind.name == "blend-by-grid") return;
  add("180", head_on(configuration, .5, .5, false), times(kind.value(-1), -std::expm1(-1) / 2),
      configuration.grid);
  if (kind.ends_forwards)
    add("0", head_on(configuration, .5, .5, true), times(kind.value(1), .5 * std::exp(-.5)),
        configuration.grid);
}

// A ray past a lamp, on which all scattering angles occur (passing()). Points are also sampled about the
// lamp.
void past_a_lamp(Table& t, const Kind& kind, const Configuration& configuration) {
  constexpr double kBeside = .5, kSigma = .2;
  Channels expected;
  for (std::size_t c = 0; c < 3; ++c)
    expected[c] = kSigma / (4 * kPi * kBeside) *
                  integrate(
                      [&](double q) {
                        const double along = kBeside * std::tan(q);
                        return kind.value(-std::sin(q))[c] *
                               std::exp(-kSigma * (along + 3 + std::hypot(kBeside, along)));
                      },
                      -std::atan(3 / kBeside), std::atan(3 / kBeside), 20'000);
  t.mean(fmt::format("phase-{}-past-a-lamp{}", kind.name, configuration.name()), "N18 N21 N27",
         "A ray past a lamp: the integral over all angles by which its light is scattered.",
         with_phase(beside_a_watt(passing(configuration, rgb(kSigma), rgb(1)), kBeside), kind), expected,
         {.slack = 1e-5, .slow = configuration.grid});
}

// Walls of radiance 1 around a medium without absorption: with the right weights of all strategies, and with
// directions whose weights have the mean 1 in every colour, it is as bright as they are.
void shining_sphere(Table& t, const Kind& kind, bool distant) {
  const Configuration configuration{false, distant};
  SceneBuilder builder;
  configuration.choose(builder);
  const MediumIndex m = builder.homogeneous(rgb(1), rgb(1));
  builder.lamp(SphereShape{}, {}).flip_normals = true;
  builder.scene.sensor.medium = m;
  builder.look({.2, -.3, .1}, {.5, .9, 0}, 60);
  t.mean(fmt::format("phase-{}-shining-sphere/{}", kind.name, configuration.integrator_name()), "7.6c N27",
         "Shining walls around a medium that absorbs nothing: as bright as they are.",
         with_phase(std::move(builder), kind), grey(1), {.channels = true, .slow = distant});
}

}  // namespace

void add_phase_functions(Table& t) {
  for (const Kind& kind : kinds()) {
    for (const Configuration& configuration : all_configurations()) {
      once(t, kind, configuration);
      past_a_lamp(t, kind, configuration);
    }
    for (const bool distant : {false, true}) shining_sphere(t, kind, distant);
  }
}

}  // namespace ls::cases
