// Media within and across each other, and boundaries on each other: what is split or put together by scenes
// is one thing in the light.
#include <cmath>

#include "tests/statistical/case.h"

namespace ls::test {
namespace {

// An endless slab of optical depth 1 and albedo .9 between mirrors, seen along its normal; see slabs.cpp.
constexpr double kReflected = .267410, kTransmitted = .591625, kDigits = 1e-5;
struct Column {
  SceneKit kit;
  BsdfIndex null;
};
Column column(bool transmitted) {
  Column c;
  SceneKit& kit = c.kit;
  c.null = kit.null();
  const BsdfIndex mirror = kit.mirror(), black = kit.diffuse(0);
  for (const double x : {-.5, .5}) {
    kit.shape(RectangleShape{}, translate({x, 0, 1}) * rotate_y(90) * scale(3, .6, 1), mirror);
    kit.shape(RectangleShape{}, translate({0, x, 1}) * rotate_x(90) * scale(.6, 3, 1), mirror);
  }
  kit.shape(RectangleShape{}, translate({0, 0, transmitted ? 3. : -1.}) * scale(.6), black);
  kit.environment();
  kit.look({.1, .15, 2}, {.1, .15, 0}, 1e-3, {0, 1, 0});
  return c;
}
Case reflected(const char* name, const SceneKit& kit) {
  Case c{name, kit, grey(kReflected), 4096, .01};
  c.slack = kDigits;
  return c;
}
void slab(Column& c, MediumIndex m) {
  c.kit.container(CubeShape{}, translate({0, 0, .5}) * scale(.6, .6, .5), c.null, m);
}

// Two identical media of half the density, in two boxes that are the same: as one (STABILITY N69).
Case twice_half() {
  Column c = column(false);
  const MediumIndex half = c.kit.homogeneous(rgb(.5), rgb(.9));
  slab(c, half);
  slab(c, half);
  return reflected("overlap_twice_half_R", c.kit);
}
// A grid and a homogeneous medium; the integrator that looks for light along segments sees them too.
Case grid_and_constant(bool transmitted, const char* integrator, const char* name) {
  Column c = column(transmitted);
  slab(c, c.kit.homogeneous(rgb(.4), rgb(.9)));
  slab(c, c.kit.heterogeneous(c.kit.grid({2, 2, 2}, std::vector<float>(8, .5f),
                                         translate({-.6, -.6, 0}) * scale(1.2, 1.2, 1)),
                              rgb(.9), 1.2));
  c.kit.scene.integrator.name = integrator;
  Case r = reflected(name, c.kit);
  if (transmitted) r.expected = grey(kTransmitted);
  return r;
}
// Eight boxes that share their faces (STABILITY 7.7).
Case split_in_eight() {
  Column c = column(false);
  const MediumIndex m = c.kit.homogeneous(rgb(1), rgb(.9));
  for (int i = 0; i < 8; ++i)
    c.kit.container(CubeShape{},
                    translate({i & 1 ? .3 : -.3, i & 2 ? .3 : -.3, i & 4 ? .75 : .25}) * scale(.3, .3, .25),
                    c.null, m);
  return reflected("overlap_split_in_eight_R", c.kit);
}
// A thinner medium of higher priority takes a layer of the other, which is thicker to make up for it.
Case by_priority() {
  Column c = column(false);
  c.kit.container(CubeShape{}, translate({0, 0, .5}) * scale(.6, .6, .5), c.null,
                  c.kit.homogeneous(rgb(1.5), rgb(.9)));
  const MediumIndex thin = c.kit.homogeneous(rgb(.5), rgb(.9));
  std::get<HomogeneousMedium>(c.kit.scene.media.back()).priority = 2;
  c.kit.container(CubeShape{}, translate({0, 0, .25}) * scale(.6, .6, .25), c.null, thin);
  return reflected("overlap_by_priority_R", c.kit);
}

// Everything scatters and nothing is lost: 1, whatever lies across what, in every channel.
Case white_crowd() {
  SceneKit kit;
  const BsdfIndex null = kit.null();
  kit.container(SphereShape{}, {}, null, kit.homogeneous({.5, 1, 2}, rgb(1), .5));
  kit.container(CubeShape{}, translate({.6, .1, 0}) * scale(.9), null,
                kit.homogeneous({2, .3, 1}, rgb(1), -.4));
  std::vector<float> values(4 * 4 * 4);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i * 7 % 5) / 2;
  kit.container(
      CubeShape{}, scale(1.2), null,
      kit.heterogeneous(kit.grid({4, 4, 4}, values, translate({-1, -1, -1}) * scale(2)), rgb(1), 1.5, .8));
  const MediumIndex ranked = kit.homogeneous({3, 3, 1}, rgb(1));
  std::get<HomogeneousMedium>(kit.scene.media.back()).priority = 1;
  kit.container(SphereShape{}, translate({0, .5, .4}) * scale(.5), null, ranked);
  kit.environment();
  kit.look({.4, -6, .7}, {0, 0, 0}, 25);
  return {"overlap_white_crowd", kit, grey(1), 1024, .008};
}

// Two media that give off light and absorb, in one box: (e1 + e2) (1 - e^-(s1 + s2) d) / (s1 + s2).
Case glowing(bool grid) {
  SceneKit kit;
  const BsdfIndex null = kit.null();
  const Rgb s1{.5, 1, .2}, s2{1, .25, .6}, e1{1, 2, 0}, e2{.5, 1, 3};
  HomogeneousMedium one;
  one.sigma_t = s1;
  one.albedo = rgb(0);
  one.phase = kit.phase(0);
  one.emission = e1;
  kit.container(CubeShape{}, {}, null, SceneKit::push<MediumTag>(kit.scene.media, one));
  if (grid) {
    HeterogeneousMedium two;
    two.sigma_t = kit.constant(s2);
    std::get<ConstVolume>(kit.scene.volumes.back()).to_world = translate({-1, -1, -1}) * scale(2);
    two.albedo = kit.constant(rgb(0));
    two.phase = kit.phase(0);
    two.emission = kit.constant(e2);
    kit.container(CubeShape{}, {}, null, SceneKit::push<MediumTag>(kit.scene.media, two));
  } else {
    one.sigma_t = s2;
    one.emission = e2;
    kit.container(CubeShape{}, {}, null, SceneKit::push<MediumTag>(kit.scene.media, one));
  }
  kit.look({-5, .1, .2}, {0, .1, .2});
  Case c{grid ? "overlap_glow_grid" : "overlap_glow", kit, {}, 16384};
  for (std::size_t i = 0; i < 3; ++i)
    c.expected[i] = (e1[i] + e2[i]) * -std::expm1(-2 * (s1[i] + s2[i])) / (s1[i] + s2[i]);
  return c;
}

// A lamp in two clouds, and light that is scattered once: the integral along the ray in the middle.
Case lamp() {
  constexpr double kHeight = .5, kSigma1 = .4, kSigma2 = .6, kSigma = kSigma1 + kSigma2;
  SceneKit kit;
  const BsdfIndex null = kit.null();
  kit.container(CubeShape{}, scale(3), null, kit.homogeneous(rgb(kSigma1), rgb(1)));
  kit.container(CubeShape{}, scale(3), null, kit.homogeneous(rgb(kSigma2), rgb(1)));
  kit.scene.emitters.push_back(PointEmitter{{0, 0, kHeight}, rgb(1)});
  kit.scene.integrator.max_depth = 2;
  kit.look({-5, 0, 0}, {0, 0, 0});
  double sum = 0;
  constexpr int kSteps = 200000;
  for (int i = 0; i < kSteps; ++i) {
    const double t = (i + .5) / kSteps * 6, x = t - 3, d2 = x * x + kHeight * kHeight;
    sum += kSigma / (4 * kPi) * std::exp(-kSigma * (t + std::sqrt(d2))) / d2 * 6 / kSteps;
  }
  return {"overlap_lamp", kit, grey(sum), 16384, .01};
}

}  // namespace

void add_overlaps(std::vector<Case>& cases) {
  cases.push_back(twice_half());
  cases.push_back(grid_and_constant(false, "volpath", "overlap_grid_and_constant_R"));
  cases.push_back(grid_and_constant(true, "volpath", "overlap_grid_and_constant_T"));
  cases.push_back(grid_and_constant(false, "volpath_distant_mis", "overlap_grid_and_constant_distant_R"));
  cases.push_back(split_in_eight());
  cases.push_back(by_priority());
  cases.push_back(white_crowd());
  cases.push_back(glowing(false));
  cases.push_back(glowing(true));
  cases.push_back(lamp());
}

}  // namespace ls::test
