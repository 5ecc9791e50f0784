// Multiple scattering in plane-parallel media, compared with tabulated reflectances and transmittances
// (docs/measurements/stability.md 7.1, 7.2 and 7.5; Chandrasekhar 1950, Giovanelli 1955, van de Hulst 1980).
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"
#include "validation/measure/measure.h"

namespace ls::cases {
namespace {

constexpr double kDigits = 5e-6;  // half a unit of the tables' sixth decimal, relative to a value of 0.1
const DirectionalEmitter kSun{{0, 0, -1}, rgb(1)};

void semi_infinite(Table& t) {
  struct Row {
    double albedo, normal, slanted, l_over_e, digits;
  };
  for (const Row& row :
       {Row{.5, .115226, .160144, .031148, 2e-5}, Row{.9, .414947, .507939, .122572, 5e-6}}) {
    for (const Configuration& configuration : two_configurations()) {
      for (const double cosine : {1., .5})
        t.mean(fmt::format("7.1-semi-infinite-a{:g}-mu{:g}{}", row.albedo, cosine, configuration.name()),
               "7.1", "An endless medium in a sky: 1 - sqrt(1 - a) H(mu).",
               [=] { return half_space(configuration, row.albedo, 40, cosine); },
               grey(cosine == 1 ? row.normal : row.slanted), {.slack = kDigits, .slow = row.albedo < .9});
      t.mean(fmt::format("7.1-normal-to-normal-a{:g}{}", row.albedo, configuration.name()), "7.1",
             "An endless medium in the sun, both along the normal: L / E = a H(1)^2 / (8 pi).",
             [=] { return lit_by(half_space(configuration, row.albedo, 40, 1), kSun); }, grey(row.l_over_e),
             {.slack = row.digits});
    }
  }
  // The answer for a white slab of optical depth tau = 64 is the radiance of a white half space, 0.336428,
  // minus the part that the slab transmits, (4/3) K^2 / (tau + 1.42089) / pi with K = (sqrt(3) / 4) H(1).
  const double k = std::sqrt(3.) / 4 * 2.907811;
  t.mean("7.1-normal-to-normal-a1/homogeneous/volpath", "7.1 N17", "The same of a white slab of depth 64.",
         [] {
           return lit_by(column({}, {1, 0, 64}, false), kSun);
         },
         grey(.336428 - 4. / 3 * k * k / 65.42089 / kPi),
         {.band = .01, .why_band = "paths of hundreds of scatterings", .slack = 1e-5, .slow = true});
}

// Adds a white disk of radius height / 20, at `height` above the point `foot` of a face of a medium, and
// points the camera at its underside. The cosine-weighted light of the whole face falls on the disk. So the
// radiance of the disk is the reflectance of the medium in uniform light, less the little light that the disk
// itself blocks.
void add_small_plate(SceneBuilder& builder, const Vec3& foot, double height) {
  const double radius = height / 20, x = foot[0], y = foot[1], z = foot[2];
  builder.shape(DiskShape{}, translate({x, y, z + height}) * rotate_x(180) * scale(radius),
                builder.diffuse(1));
  builder.look({x + .1 * radius, y, z + height / 2}, {x, y, z + height}, .1, {0, 1, 0});
  builder.scene.sensor.near_clip = 1e-9;
}

// The spherical albedo of a half space (its reflectance in uniform light), measured on a cube of side 1 and
// optical depth 40. The disk is 0.001 (0.04 mean free paths) above the face. The radius of the disk is 0.002
// mean free paths, so it shadows a share of about (0.002)^2 of the light that it receives. A share of
// (2 x 0.001)^2 of its cosine-weighted view lies beside the cube.
void spherical(Table& t) {
  struct Row {
    double albedo, reflected;
  };
  for (const Row& row : {Row{.5, .146544}, Row{.9, .478024}})
    t.mean(fmt::format("7.1-spherical-albedo-a{:g}/homogeneous/volpath", row.albedo), "7.1",
           "An endless medium in a sky, by the light on a small white plate that faces it.",
           [=] {
             SceneBuilder builder = half_space({}, row.albedo, 40, 1);
             add_small_plate(builder, {0, 0, 0}, .001);
             return builder;
           },
           grey(row.reflected), {.slack = 2 * kDigits, .slow = row.albedo < .9});
}

struct Row {
  Slab slab;
  double r, t, r_diffuse, t_diffuse;
};
constexpr Row kIsotropic[] = {{{.5, 0, 1}, .099119, .446058, .134165, .306709},
                              {{.9, 0, 1}, .267410, .591625, .352712, .474746},
                              {{.99, 0, 4}, .645047, .275480, .709734, .216634},
                              {{1, 0, 16}, .903632, .096368, .923464, .076536}};

std::string named(const char* what, const Slab& s, const char* side, const Configuration& configuration) {
  return fmt::format("7.2-{}-a{:g}-tau{:g}-{}{}", what, s.albedo, s.tau, side, configuration.name());
}

// Returns the options of a case whose answer is the transmittance `through`. If it is small, the light comes
// by long paths, and the band is 1 %.
MeanOptions of_little(double through, bool slow) {
  const bool little = through < .3;
  return {.band = little ? .01 : kBand,
          .why_band = little ? "little gets through, by long paths" : "",
          .slack = kDigits * 10,
          .slow = slow};
}
// True if the transmittance of the slab is tested in both configurations, false if only in the faster one.
// The reflectance is always tested in both.
bool by_both(const Slab& slab) { return slab.tau < 10; }

void isotropic(Table& t) {
  for (const Row& row : kIsotropic) {
    for (const Configuration& configuration : two_configurations()) {
      t.mean(named("slab", row.slab, "R", configuration), "7.2",
             "What an isotropic slab reflects at normal incidence.",
             [=] { return column(configuration, row.slab, false); }, grey(row.r),
             {.slack = kDigits * 10, .slow = row.slab.albedo != .9});
      if (configuration.grid && !by_both(row.slab)) continue;
      t.mean(
          named("slab", row.slab, "T", configuration), "7.2",
          "What an isotropic slab lets through at normal incidence.",
          [=] { return column(configuration, row.slab, true); }, grey(row.t),
          of_little(row.t, row.slab.albedo != .9));
    }
  }
  t.mean("7.2-slab-split-by-a-boundary/homogeneous/volpath", "7.2 7.7",
         "A boundary that changes nothing, at a third of it.",
         [] {
           return column({}, {.9, 0, 1, 1, true}, false);
         },
         grey(.267410), {.slack = kDigits * 10, .slow = true});
}

// A plate of reflectance 1/2 above the slab, with the environment below the slab; the mirrors of the column
// surround both. The plate receives the cosine-weighted light of the slab. With R and T the reflectance and
// transmittance of the slab for diffuse light, and B the irradiance of the plate divided by pi,
// B = T + R B / 2. The radiance of the plate is B / 2.
SceneBuilder plate_above(const Configuration& configuration, Slab slab) {
  slab.wall = .5;
  SceneBuilder builder = column(configuration, slab, true);
  Shape& end = builder.scene.shapes[4];  // the black plate of empty_column()
  end.bsdf = builder.diffuse(.5);
  end.to_world = translate({0, 0, slab.tau + 2}) * rotate_x(180) * scale(slab.reach());
  builder.look({.1, .15, slab.tau + 1}, {.1, .15, slab.tau + 2}, 1e-3, {0, 1, 0});
  return builder;
}

// A small white disk above the slab, which receives the light that the slab reflects from an environment
// above it. The disk hides at most (0.0025)^2 of the environment.
SceneBuilder plate_facing(const Configuration& configuration, const Slab& slab) {
  SceneBuilder builder = column(configuration, slab, false);
  add_small_plate(builder, {.1, .15, slab.tau}, .05);
  return builder;
}

void diffuse(Table& t) {
  for (const Row& row : kIsotropic) {
    for (const Configuration& configuration : two_configurations()) {
      if (configuration.grid && row.slab.tau > 1) continue;  // takes long; isotropic() tests deep grids
      const double lit = row.t_diffuse / (1 - row.r_diffuse / 2);
      const bool slow = row.slab.albedo != .9 || configuration.grid;
      t.mean(
          named("diffuse", row.slab, "T", configuration), "7.2",
          "A white plate over a slab that the sky shines through.",
          [=] { return plate_above(configuration, row.slab); }, grey(lit / 2),
          of_little(row.t_diffuse, slow));
      t.mean(named("diffuse", row.slab, "R", configuration), "7.2",
             "A small white plate over a slab in a sky: by what comes up to it.",
             [=] { return plate_facing(configuration, row.slab); }, grey(row.r_diffuse),
             {.slack = kDigits * 10, .slow = slow});
    }
  }
}

void dielectric(Table& t) {
  for (const Configuration& configuration : two_configurations()) {
    t.mean("7.5-glass-semi-infinite" + configuration.name(), "7.5",
           "An endless medium of index 1.5 (Giovanelli 1955), its mirror image of the sky included.",
           [=] {
             return column(configuration, {.9, 0, 20, 1.5}, false);
           },
           grey(.25992), {.slack = 4e-5, .slow = configuration.grid});
    t.mean("7.5-water-slab-T" + configuration.name(), "7.5", "A slab of water that scatters forward.",
           [=] {
             return column(configuration, {.9, .75, 2, 1.33}, true);
           },
           grey(.55168), {.slack = 1e-4, .slow = configuration.grid});
  }
  // The slab reflects little light, most of it by few paths, so this is slow. It is tested in the faster
  // configuration only.
  t.mean("7.5-water-slab-R/homogeneous/volpath", "7.5", "A slab of water that scatters forward.",
         [] {
           return column({}, {.9, .75, 2, 1.33}, false);
         },
         grey(.10931), {.slack = 1e-4, .slow = true});
}

// Returns the share R_1 of uniform light that a slab reflects along its normal by single scattering. With a
// the albedo, tau the optical depth and mu the cosine of the angle of incidence,
// R_1 = (a/2) int_0^1 mu / (1 + mu) (1 - e^(-tau (1 + 1/mu))) dmu.
double first_order(double albedo, double tau) {
  return albedo / 2 *
         integrate(
             [tau](double mu) { return mu == 0 ? 0 : mu / (1 + mu) * -std::expm1(-tau * (1 + 1 / mu)); }, 0,
             1, 20'000);
}

// Returns the light that a white half space reflects along its normal after one, two and three scatterings.
// These are the first three terms of 1 - sqrt(1 - a) H(1) as a power series of the albedo a, at a = 1. The
// terms of H follow from its equation, H(mu) = 1 + (a / 2) mu H(mu) int_0^1 H(m) / (mu + m) dm. The
// substitution m = x^2 removes the logarithm at the ends of the integrals, so that Simpson's rule is accurate
// to 1e-8.
std::array<double, 3> orders_of_endless() {
  const auto over = [](auto h, double mu) {
    return integrate([&](double x) { return h(x * x) / (mu + x * x) * 2 * x; }, 0, 1, 100);
  };
  const auto log = [](double mu) { return std::log1p(1 / mu); };
  const auto h1 = [&](double mu) { return mu > 0 ? mu / 2 * log(mu) : 0; };
  const auto h2 = [&](double mu) { return mu > 0 ? mu / 2 * (h1(mu) * log(mu) + over(h1, mu)) : 0; };
  const double first = h1(1), second = h2(1),
               third = .5 * (second * log(1) + first * over(h1, 1) + over(h2, 1));
  return {1. / 2 - first, 1. / 8 + first / 2 - second, 1. / 16 + first / 8 + second / 2 - third};
}

// A white slab in an environment, with paths of at most `scatterings` scatterings. It has no mirrors at its
// sides, since reflections there would count as scatterings; instead it is very wide.
SceneBuilder wide_slab(const Configuration& configuration, double tau, int scatterings) {
  SceneBuilder builder = column(configuration, {1, 0, tau}, false);
  builder.scene.shapes.erase(builder.scene.shapes.begin(), builder.scene.shapes.begin() + 4);
  for (Shape& s : builder.scene.shapes) s.to_world = s.to_world * scale(60, 60, 1);
  builder.scene.integrator.max_depth = 1 + scatterings;
  return builder;
}

// Compares a column (a slab between mirrors) whose paths may scatter `order` times with one whose paths may
// scatter once more. The figure is 1 if the second is brighter; 1 is expected.
Figure more_light(const Bench& bench, int order) {
  double mean[2] = {0, 0};
  Figure f{.expected = 1};
  for (const int more : {0, 1}) {
    SceneBuilder builder = column({}, {.9, 0, 1}, false);
    builder.scene.integrator.max_depth = 1 + order + more;
    builder.scene.integrator.rr_depth = 1000;
    const auto p = shoot(builder, 64, bench);
    if (!p) return {.why = p.error().message};
    f.unhealthy += cli::samples_gone_wrong(p->health);
    for (std::size_t i = 0; i < p->sums.size() / 6; ++i) mean[more] += p->mean(i, 1);
  }
  f.got = mean[1] > mean[0] ? 1 : 0;
  return f;
}

void orders(Table& t) {
  for (const Configuration& configuration : two_configurations()) {
    for (const double tau : {1., 4., 60.}) {
      if (tau == 4 && configuration.grid) continue;  // grids are tested at depths 1 and 60
      t.mean(fmt::format("7.6h-once-tau{:g}{}", tau, configuration.name()), "7.6h",
             "What a slab reflects of light scattered once: .142015352, .153412899, (1 - ln 2) / 2.",
             [=] { return wide_slab(configuration, tau, 1); }, grey(first_order(1, tau)),
             {.slack = 1e-4, .slow = tau == 4});
    }
  }
  const auto each = orders_of_endless();
  for (const int most : {2, 3})
    t.mean(fmt::format("7.6h-up-to-{}-tau60/homogeneous/volpath", most), "7.6h",
           "What a slab reflects of light scattered at most twice, or three times: .250699746, .319941097.",
           [=] { return wide_slab({}, 60, most); }, grey(each[0] + each[1] + (most > 2 ? each[2] : 0)),
           {.slack = 1e-4, .slow = true});
  // Each order of scattering must add light.
  for (int order = 1; order <= 8; order *= 2) {
    t.exact(fmt::format("7.6h-order-{}-adds-light/homogeneous/volpath", order), "7.6h",
            "One more scattering, more light: the same numbers, paths one segment longer.",
            [order](const Bench& b) { return more_light(b, order); });
  }
}

}  // namespace

void add_slabs(Table& t) {
  semi_infinite(t);
  spherical(t);
  isotropic(t);
  diffuse(t);
  dielectric(t);
  orders(t);
}

}  // namespace ls::cases
