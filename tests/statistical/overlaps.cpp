// Media within and across each other, and boundaries on each other: what is split or put together by scenes
// is one thing in the light.
#include <cmath>

#include "tests/statistical/case.h"

namespace ls::test {
namespace {

// An endless slab of optical depth 1 and albedo .9 between mirrors, seen along its normal; see slabs.cpp.
constexpr double kReflected = .267410, kTransmitted = .591625, kDigits = 1e-5;
struct Column {
  SceneBuilder builder;
  BsdfIndex null;
};
Column column(bool transmitted) {
  Column c;
  SceneBuilder& builder = c.builder;
  c.null = builder.null();
  const BsdfIndex mirror = builder.mirror(), black = builder.diffuse(0);
  for (const double x : {-.5, .5}) {
    builder.shape(RectangleShape{}, translate({x, 0, 1}) * rotate_y(90) * scale(3, .6, 1), mirror);
    builder.shape(RectangleShape{}, translate({0, x, 1}) * rotate_x(90) * scale(.6, 3, 1), mirror);
  }
  builder.shape(RectangleShape{}, translate({0, 0, transmitted ? 3. : -1.}) * scale(.6), black);
  builder.environment();
  builder.look({.1, .15, 2}, {.1, .15, 0}, 1e-3, {0, 1, 0});
  return c;
}
Case reflected(const char* name, const SceneBuilder& builder) {
  Case c{name, builder, grey(kReflected), 4096, .01};
  c.slack = kDigits;
  return c;
}
void slab(Column& c, MediumIndex m) {
  c.builder.container(CubeShape{}, translate({0, 0, .5}) * scale(.6, .6, .5), c.null, m);
}

// Two identical media of half the density, in two boxes that are the same: as one (STABILITY N69).
Case twice_half() {
  Column c = column(false);
  const MediumIndex half = c.builder.homogeneous(rgb(.5), rgb(.9));
  slab(c, half);
  slab(c, half);
  return reflected("overlap_twice_half_R", c.builder);
}
// A grid and a homogeneous medium; the integrator that looks for light along segments sees them too.
Case grid_and_constant(bool transmitted, const char* integrator, const char* name) {
  Column c = column(transmitted);
  slab(c, c.builder.homogeneous(rgb(.4), rgb(.9)));
  slab(c, c.builder.heterogeneous(c.builder.grid({2, 2, 2}, std::vector<float>(8, .5f),
                                                 translate({-.6, -.6, 0}) * scale(1.2, 1.2, 1)),
                                  rgb(.9), 1.2));
  c.builder.scene.integrator.name = integrator;
  Case r = reflected(name, c.builder);
  if (transmitted) r.expected = grey(kTransmitted);
  return r;
}
// Eight boxes that share their faces (STABILITY 7.7).
Case split_in_eight() {
  Column c = column(false);
  const MediumIndex m = c.builder.homogeneous(rgb(1), rgb(.9));
  for (int i = 0; i < 8; ++i)
    c.builder.container(
        CubeShape{}, translate({i & 1 ? .3 : -.3, i & 2 ? .3 : -.3, i & 4 ? .75 : .25}) * scale(.3, .3, .25),
        c.null, m);
  return reflected("overlap_split_in_eight_R", c.builder);
}
// A thinner medium of higher priority takes a layer of the other, which is thicker to make up for it.
Case by_priority() {
  Column c = column(false);
  c.builder.container(CubeShape{}, translate({0, 0, .5}) * scale(.6, .6, .5), c.null,
                      c.builder.homogeneous(rgb(1.5), rgb(.9)));
  const MediumIndex thin = c.builder.homogeneous(rgb(.5), rgb(.9));
  std::get<HomogeneousMedium>(c.builder.scene.media.back()).priority = 2;
  c.builder.container(CubeShape{}, translate({0, 0, .25}) * scale(.6, .6, .25), c.null, thin);
  return reflected("overlap_by_priority_R", c.builder);
}

// Everything scatters and nothing is lost: 1, whatever lies across what, in every channel.
Case white_crowd() {
  SceneBuilder builder;
  const BsdfIndex null = builder.null();
  builder.container(SphereShape{}, {}, null, builder.homogeneous({.5, 1, 2}, rgb(1), .5));
  builder.container(CubeShape{}, translate({.6, .1, 0}) * scale(.9), null,
                    builder.homogeneous({2, .3, 1}, rgb(1), -.4));
  std::vector<float> values(4 * 4 * 4);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i * 7 % 5) / 2;
  builder.container(CubeShape{}, scale(1.2), null,
                    builder.heterogeneous(builder.grid({4, 4, 4}, values, translate({-1, -1, -1}) * scale(2)),
                                          rgb(1), 1.5, .8));
  const MediumIndex ranked = builder.homogeneous({3, 3, 1}, rgb(1));
  std::get<HomogeneousMedium>(builder.scene.media.back()).priority = 1;
  builder.container(SphereShape{}, translate({0, .5, .4}) * scale(.5), null, ranked);
  builder.environment();
  builder.look({.4, -6, .7}, {0, 0, 0}, 25);
  return {"overlap_white_crowd", builder, grey(1), 1024, .008};
}

// Two media that give off light and absorb, in one box: (e1 + e2) (1 - e^-(s1 + s2) d) / (s1 + s2).
Case glowing(bool grid) {
  SceneBuilder builder;
  const BsdfIndex null = builder.null();
  const Rgb s1{.5, 1, .2}, s2{1, .25, .6}, e1{1, 2, 0}, e2{.5, 1, 3};
  HomogeneousMedium one;
  one.sigma_t = s1;
  one.albedo = rgb(0);
  one.phase = builder.phase(0);
  one.emission = e1;
  builder.container(CubeShape{}, {}, null, SceneBuilder::push<MediumTag>(builder.scene.media, one));
  if (grid) {
    HeterogeneousMedium two;
    two.sigma_t = builder.constant(s2);
    std::get<ConstVolume>(builder.scene.volumes.back()).to_world = translate({-1, -1, -1}) * scale(2);
    two.albedo = builder.constant(rgb(0));
    two.phase = builder.phase(0);
    two.emission = builder.constant(e2);
    builder.container(CubeShape{}, {}, null, SceneBuilder::push<MediumTag>(builder.scene.media, two));
  } else {
    one.sigma_t = s2;
    one.emission = e2;
    builder.container(CubeShape{}, {}, null, SceneBuilder::push<MediumTag>(builder.scene.media, one));
  }
  builder.look({-5, .1, .2}, {0, .1, .2});
  Case c{grid ? "overlap_glow_grid" : "overlap_glow", builder, {}, 16384};
  for (std::size_t i = 0; i < 3; ++i)
    c.expected[i] = (e1[i] + e2[i]) * -std::expm1(-2 * (s1[i] + s2[i])) / (s1[i] + s2[i]);
  return c;
}

// A lamp in two clouds, and light that is scattered once: the integral along the ray in the middle.
Case lamp() {
  constexpr double kHeight = .5, kSigma1 = .4, kSigma2 = .6, kSigma = kSigma1 + kSigma2;
  SceneBuilder builder;
  const BsdfIndex null = builder.null();
  builder.container(CubeShape{}, scale(3), null, builder.homogeneous(rgb(kSigma1), rgb(1)));
  builder.container(CubeShape{}, scale(3), null, builder.homogeneous(rgb(kSigma2), rgb(1)));
  builder.scene.emitters.push_back(PointEmitter{{0, 0, kHeight}, rgb(1)});
  builder.scene.integrator.max_depth = 2;
  builder.look({-5, 0, 0}, {0, 0, 0});
  double sum = 0;
  constexpr int kSteps = 200000;
  for (int i = 0; i < kSteps; ++i) {
    const double t = (i + .5) / kSteps * 6, x = t - 3, d2 = x * x + kHeight * kHeight;
    sum += kSigma / (4 * kPi) * std::exp(-kSigma * (t + std::sqrt(d2))) / d2 * 6 / kSteps;
  }
  return {"overlap_lamp", builder, grey(sum), 16384, .01};
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
