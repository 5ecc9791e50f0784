// Multiple scattering in plane-parallel media: tabulated reflectances and transmittances (STABILITY section
// 7; Chandrasekhar 1950, Giovanelli 1955, van de Hulst 1980).
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"
#include "cli/cases/stages.h"
#include "cli/validate_measure.h"

namespace ls::cases {
namespace {

constexpr double kDigits = 5e-6;  // half a unit of the last place that the tables give, at .1

void semi_infinite(Table& t) {
  struct Row {
    double albedo, normal, slanted, l_over_e, digits;
  };
  for (const Row& row :
       {Row{.5, .115226, .160144, .031148, 2e-5}, Row{.9, .414947, .507939, .122572, 5e-6}}) {
    for (const Way& way : two_ways()) {
      for (const double cosine : {1., .5})
        t.mean(fmt::format("7.1-semi-infinite-a{:g}-mu{:g}{}", row.albedo, cosine, way.name()), "7.1",
               "An endless medium in a sky: 1 - sqrt(1 - a) H(mu).",
               [=] { return half_space(way, row.albedo, 40, cosine); },
               grey(cosine == 1 ? row.normal : row.slanted), {.slack = kDigits, .slow = row.albedo < .9});
      t.mean(fmt::format("7.1-normal-to-normal-a{:g}{}", row.albedo, way.name()), "7.1",
             "An endless medium in the sun, both along the normal: L / E = a H(1)^2 / (8 pi).",
             [=] {
               SceneKit kit = half_space(way, row.albedo, 40, 1);
               kit.scene.emitters = {DirectionalEmitter{{0, 0, -1}, rgb(1)}};
               return kit;
             },
             grey(row.l_over_e), {.slack = row.digits});
    }
  }
  // White, of optical depth 64: the endless medium's .336428 less what gets through,
  // (4/3) K^2 / (tau + 1.42089) / pi with K = sqrt(3) / 4 H(1).
  const double k = std::sqrt(3.) / 4 * 2.907811;
  t.mean("7.1-normal-to-normal-a1/homogeneous/volpath", "7.1 N17", "The same of a white slab of depth 64.",
         [] {
           SceneKit kit = column({}, {1, 0, 64}, false);
           kit.scene.emitters = {DirectionalEmitter{{0, 0, -1}, rgb(1)}};
           return kit;
         },
         grey(.336428 - 4. / 3 * k * k / 65.42089 / kPi),
         {.band = .01, .why_band = "paths of hundreds of scatterings", .slack = 1e-5, .slow = true});
}

// A white plate this far above a face at `foot`, a twentieth of that in radius, seen from below: it sees all
// of the face under the cosine, so that what it shows is what the medium reflects of light from everywhere,
// but for the sky that it hides.
void add_small_plate(SceneKit& kit, const Vec3& foot, double height) {
  const double radius = height / 20, x = foot[0], y = foot[1], z = foot[2];
  kit.shape(DiskShape{}, translate({x, y, z + height}) * rotate_x(180) * scale(radius), kit.diffuse(1));
  kit.look({x + .1 * radius, y, z + height / 2}, {x, y, z + height}, .1, {0, 1, 0});
  kit.scene.sensor.near_clip = 1e-9;
}

// An endless medium's spherical albedo. Depths are 40 and a cube's side is 1: the plate is .04 mean free
// paths above the face, and its shadow of (.002)^2 mean free paths is that share of what it sees; past the
// cube it sees (2 x .001)^2.
void spherical(Table& t) {
  struct Row {
    double albedo, reflected;
  };
  for (const Row& row : {Row{.5, .146544}, Row{.9, .478024}})
    t.mean(fmt::format("7.1-spherical-albedo-a{:g}/homogeneous/volpath", row.albedo), "7.1",
           "An endless medium in a sky, by the light on a small white plate that faces it.",
           [=] {
             SceneKit kit = half_space({}, row.albedo, 40, 1);
             add_small_plate(kit, {0, 0, 0}, .001);
             return kit;
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

std::string named(const char* what, const Slab& s, const char* side, const Way& way) {
  return fmt::format("7.2-{}-a{:g}-tau{:g}-{}{}", what, s.albedo, s.tau, side, way.name());
}

// What little gets through a deep slab takes long paths to tell: to 1 % of it, and by the quicker way; of the
// slab of depth 16, which is white, R tells it by the other.
MeanOptions of_little(double through, bool slow) {
  const bool little = through < .3;
  return {.band = little ? .01 : kBand,
          .why_band = little ? "little gets through, by long paths" : "",
          .slack = kDigits * 10,
          .slow = slow};
}
bool by_both_ways(const Slab& slab) { return slab.tau < 10; }

void isotropic(Table& t) {
  for (const Row& row : kIsotropic) {
    for (const Way& way : two_ways()) {
      t.mean(named("slab", row.slab, "R", way), "7.2", "What an isotropic slab reflects at normal incidence.",
             [=] { return column(way, row.slab, false); }, grey(row.r),
             {.slack = kDigits * 10, .slow = row.slab.albedo != .9});
      if (way.grid && !by_both_ways(row.slab)) continue;
      t.mean(
          named("slab", row.slab, "T", way), "7.2",
          "What an isotropic slab lets through at normal incidence.",
          [=] { return column(way, row.slab, true); }, grey(row.t), of_little(row.t, row.slab.albedo != .9));
    }
  }
  t.mean("7.2-slab-split-by-a-boundary/homogeneous/volpath", "7.2 7.7",
         "A boundary that changes nothing, at a third of it.",
         [] {
           return column({}, {.9, 0, 1, 1, true}, false);
         },
         grey(.267410), {.slack = kDigits * 10, .slow = true});
}

// A white plate (1/2) in the column above the slab sees it under the cosine: with R and T the slab's for
// diffuse light and the sky below, the plate is lit by B = T + R B / 2, and shows B / 2.
SceneKit plate_above(const Way& way, Slab slab) {
  slab.wall = .5;
  SceneKit kit = column(way, slab, true);
  Shape& end = kit.scene.shapes.back();  // black, behind what is looked at from above
  end.bsdf = kit.diffuse(.5);
  end.to_world = translate({0, 0, slab.tau + 2}) * rotate_x(180) * scale(slab.reach());
  kit.look({.1, .15, slab.tau + 1}, {.1, .15, slab.tau + 2}, 1e-3, {0, 1, 0});
  return kit;
}

// What the slab reflects of a sky above it, by a plate that hides (.0025)^2 of it at most.
SceneKit plate_facing(const Way& way, const Slab& slab) {
  SceneKit kit = column(way, slab, false);
  add_small_plate(kit, {.1, .15, slab.tau}, .05);
  return kit;
}

void diffuse(Table& t) {
  for (const Row& row : kIsotropic) {
    for (const Way& way : two_ways()) {
      if (way.grid && row.slab.tau > 1) continue;  // long, for what the slabs above show of grids
      const double lit = row.t_diffuse / (1 - row.r_diffuse / 2);
      const bool slow = row.slab.albedo != .9 || way.grid;
      t.mean(
          named("diffuse", row.slab, "T", way), "7.2",
          "A white plate over a slab that the sky shines through.",
          [=] { return plate_above(way, row.slab); }, grey(lit / 2), of_little(row.t_diffuse, slow));
      t.mean(named("diffuse", row.slab, "R", way), "7.2",
             "A small white plate over a slab in a sky: by what comes up to it.",
             [=] { return plate_facing(way, row.slab); }, grey(row.r_diffuse),
             {.slack = kDigits * 10, .slow = slow});
    }
  }
}

void dielectric(Table& t) {
  for (const Way& way : two_ways()) {
    t.mean("7.5-glass-semi-infinite" + way.name(), "7.5",
           "An endless medium of index 1.5 (Giovanelli 1955), its mirror image of the sky included.",
           [=] {
             return column(way, {.9, 0, 20, 1.5}, false);
           },
           grey(.25992), {.slack = 4e-5, .slow = way.grid});
    t.mean("7.5-water-slab-T" + way.name(), "7.5", "A slab of water that scatters forward.",
           [=] {
             return column(way, {.9, .75, 2, 1.33}, true);
           },
           grey(.55168), {.slack = 1e-4, .slow = way.grid});
  }
  // Of little light that is turned back, most by few paths: by the quicker way.
  t.mean("7.5-water-slab-R/homogeneous/volpath", "7.5", "A slab of water that scatters forward.",
         [] {
           return column({}, {.9, .75, 2, 1.33}, false);
         },
         grey(.10931), {.slack = 1e-4, .slow = true});
}

// Scattered once only: R_1 = (a/2) int mu / (1 + mu) (1 - e^(-tau (1 + 1/mu))) dmu.
double first_order(double albedo, double tau) {
  return albedo / 2 *
         integrate(
             [tau](double mu) { return mu == 0 ? 0 : mu / (1 + mu) * -std::expm1(-tau * (1 + 1 / mu)); }, 0,
             1, 20'000);
}

// What an endless white medium reflects along its normal of light scattered one to three times: the first
// terms of 1 - sqrt(1 - a) H(1) as a power series of the albedo. Those of H follow from its equation, H = 1 +
// a / 2 mu H int H(m) / (mu + m) dm; m = x^2 takes the logarithm out of the integrals' ends, and Simpson's
// rule is good to 1e-8.
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

// A slab in a sky, white and without walls (mirrors would count as scatterings): as wide as it takes.
SceneKit wide_slab(const Way& way, double tau, int scatterings) {
  SceneKit kit = column(way, {1, 0, tau}, false);
  kit.scene.shapes.erase(kit.scene.shapes.begin(), kit.scene.shapes.begin() + 4);
  for (Shape& s : kit.scene.shapes) s.to_world = s.to_world * scale(60, 60, 1);
  kit.scene.integrator.max_depth = 1 + scatterings;
  return kit;
}

// The mean that a column shows with paths of so many scatterings, and with one more.
Figure more_light(const Bench& bench, int order) {
  double mean[2] = {0, 0};
  Figure f{.expected = 1};
  for (const int more : {0, 1}) {
    SceneKit kit = column({}, {.9, 0, 1}, false);
    kit.scene.integrator.max_depth = 1 + order + more;
    kit.scene.integrator.rr_depth = 1000;
    const auto p = shoot(kit, 64, bench);
    if (!p) return {.why = p.error().message};
    f.unhealthy += cli::samples_gone_wrong(p->health);
    for (std::size_t i = 0; i < p->sums.size() / 6; ++i) mean[more] += p->mean(i, 1);
  }
  f.got = mean[1] > mean[0] ? 1 : 0;
  return f;
}

void orders(Table& t) {
  for (const Way& way : two_ways()) {
    for (const double tau : {1., 4., 60.}) {
      if (tau == 4 && way.grid) continue;  // the same flights as at 1 and at 60
      t.mean(fmt::format("7.6h-once-tau{:g}{}", tau, way.name()), "7.6h",
             "What a slab reflects of light scattered once: .142015352, .153412899, (1 - ln 2) / 2.",
             [=] { return wide_slab(way, tau, 1); }, grey(first_order(1, tau)),
             {.slack = 1e-4, .slow = tau == 4});
    }
  }
  const auto each = orders_of_endless();
  for (const int most : {2, 3})
    t.mean(fmt::format("7.6h-up-to-{}-tau60/homogeneous/volpath", most), "7.6h",
           "What a slab reflects of light scattered at most twice, or three times: .250699746, .319941097.",
           [=] { return wide_slab({}, 60, most); }, grey(each[0] + each[1] + (most > 2 ? each[2] : 0)),
           {.slack = 1e-4, .slow = true});
  // Each order adds something, and all of them are the whole.
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
