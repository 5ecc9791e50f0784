// Multiple scattering in plane-parallel slabs: tabulated reflectances and transmittances (STABILITY section
// 7; Giovanelli 1955; van de Hulst 1980). A column with mirrors for walls is an endless slab exactly.
#include <cmath>

#include "tests/statistical/case.h"

namespace ls::test {
namespace {

struct Slab {
  double albedo = 1, g = 0, tau = 1;
  double ior = 1;      // of the slab; 1: matched boundaries
  bool grid = false;   // the same medium as a grid
  bool split = false;  // by a boundary that changes nothing
};

// The slab is [0, tau] in z. Light of radiance 1 comes in through the column's open end.
SceneKit column(const Slab& slab, bool transmitted) {
  SceneKit kit;
  const double top = slab.tau + 3, bottom = -2, half = (top - bottom) / 2, middle = (top + bottom) / 2;
  MediumIndex m{};
  if (slab.grid) {
    const VolumeIndex v = kit.grid({3, 3, 8}, std::vector<float>(72, .25f),
                                   translate({-2, -2, -1}) * scale(4, 4, slab.tau + 2));
    m = kit.heterogeneous(v, rgb(slab.albedo), 4, slab.g);
  } else {
    m = kit.homogeneous(rgb(1), rgb(slab.albedo), slab.g);
  }
  const BsdfIndex mirror = kit.mirror(), black = kit.diffuse(0), null = kit.null();
  const BsdfIndex face = slab.ior == 1 ? null : kit.glass(slab.ior);
  for (const double x : {-.5, .5}) {
    kit.shape(RectangleShape{}, translate({x, 0, middle}) * rotate_y(90) * scale(half, .6, 1), mirror);
    kit.shape(RectangleShape{}, translate({0, x, middle}) * rotate_x(90) * scale(.6, half, 1), mirror);
  }
  kit.container(RectangleShape{}, translate({0, 0, slab.tau}) * scale(.6), face, m);
  kit.container(RectangleShape{}, rotate_x(180) * scale(.6), face, m);
  if (slab.split) {
    kit.container(RectangleShape{}, translate({0, 0, slab.tau / 3}) * scale(.6), null, m).exterior = m;
  }
  kit.shape(RectangleShape{}, translate({0, 0, transmitted ? slab.tau + 2 : -1}) * scale(.6), black);
  kit.environment();
  kit.look({.1, .15, slab.tau + 1}, {.1, .15, 0}, 1e-3, {0, 1, 0});
  return kit;
}

}  // namespace

void add_slabs(std::vector<Case>& cases) {
  // `digits`: half a unit of the last place that the table gives, as a share.
  const auto add = [&](const char* name, const Slab& s, double r, double t, double digits = 1e-5,
                       std::uint64_t spp = 4096) {
    for (const bool transmitted : {false, true}) {
      const double expected = transmitted ? t : r;
      if (expected == 0) continue;
      Case c{std::string(name) + (transmitted ? "_T" : "_R"), column(s, transmitted), grey(expected), spp,
             .01};
      c.slack = digits;
      cases.push_back(std::move(c));
    }
  };
  add("slab_half_1", {.5, 0, 1}, .099119, .446058, 1e-5, 8192);
  add("slab_nine_tenths_1", {.9, 0, 1}, .267410, .591625);
  add("slab_ninety_nine_4", {.99, 0, 4}, .645047, .275480);
  add("slab_white_16", {1, 0, 16}, .903632, 0, 1e-5, 1024);
  add("slab_nine_tenths_1_grid", {.9, 0, 1, 1, true}, .267410, .591625);
  add("slab_nine_tenths_1_split", {.9, 0, 1, 1, false, true}, .267410, 0);
  add("slab_forward_2", {.9, .75, 2}, .097395, .660958, 1e-5, 8192);
  add("slab_forward_8", {1, .85, 8}, .358432, .641568, 1e-5, 4096);
  add("slab_backward_2", {1, -.5, 2}, .620494, .379506);
  add("slab_semi_infinite", {.9, 0, 20}, .414947, 0);
  add("slab_glass_semi_infinite", {.9, 0, 20, 1.5}, .25992, 0, 4e-5, 8192);
  add("slab_water_forward_2", {.9, .75, 2, 1.33}, .10931, .55168, 1e-4, 8192);
  {
    // One scattering only; the slab is 60 mean free paths wide, beyond which e^-30 is left.
    SceneKit kit;
    const MediumIndex m = kit.homogeneous(rgb(1), rgb(1));
    kit.container(CubeShape{}, translate({0, 0, .5}) * scale(30, 30, .5), kit.null(), m);
    const BsdfIndex black = kit.diffuse(0);
    kit.shape(RectangleShape{}, translate({0, 0, -.5}) * scale(60), black);
    kit.environment();
    kit.scene.integrator.max_depth = 2;
    kit.look({.1, .15, 2}, {.1, .15, 0}, 1e-3, {0, 1, 0});
    cases.push_back({"slab_first_order", kit, grey(.142015352), 8192, .01, 1e-4});
  }
}

}  // namespace ls::test
