// Nested and overlapping media, and coincident boundaries: splitting a medium into parts that touch, or into
// thinner media in the same place, must not change the light.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr Rgb kAlbedo{.9, .9, .9};

// An endless slab of optical depth 1 and albedo .9, made of boxes that `fill` adds between mirrors.
void add_slab(Table& t, const std::string& name, bool transmitted, const Configuration& configuration,
              auto fill) {
  SceneBuilder builder = empty_column({.albedo = .9, .tau = 1, .wall = .5}, transmitted);
  configuration.choose(builder);
  fill(builder);
  t.mean(fmt::format("N69-slab-{}{}", name, configuration.name()), "N69 7.2",
         "A slab of albedo .9 made of media in one place, or of boxes that touch: as one of them.", builder,
         grey(transmitted ? .591625 : .267410), {.slack = 2e-5});
}
// Adds a box as wide as the column and a little more, from z = 0 up to `height`.
void add_layer(SceneBuilder& builder, MediumIndex m, double height = 1) {
  builder.container(CubeShape{}, translate({0, 0, height / 2}) * scale(.6, .6, height / 2), builder.null(),
                    m);
}
MediumIndex ranked(SceneBuilder& builder, const Rgb& sigma, const Rgb& albedo, int priority) {
  const MediumIndex m = builder.homogeneous(sigma, albedo);
  std::get<HomogeneousMedium>(builder.scene.media.back()).priority = priority;
  return m;
}

void slabs_of_parts(Table& t) {
  add_slab(t, "of-two-halves-R", false, {}, [](SceneBuilder& builder) {
    const MediumIndex half = builder.homogeneous(rgb(.5), kAlbedo);
    add_layer(builder, half);
    add_layer(builder, half);
  });
  // Both integrators must see both media, also volpath_distant_mis, which samples light along whole segments.
  const auto grid_and_constant = [](SceneBuilder& builder) {
    add_layer(builder, builder.homogeneous(rgb(.4), kAlbedo));
    const VolumeIndex v =
        builder.grid({2, 2, 2}, std::vector<float>(8, .5f), box({-.6, -.6, 0}, {.6, .6, 1}));
    add_layer(builder, builder.heterogeneous(v, kAlbedo, 1.2));
  };
  add_slab(t, "of-grid-and-constant-R", false, {true, false}, grid_and_constant);
  add_slab(t, "of-grid-and-constant-T", true, {true, false}, grid_and_constant);
  add_slab(t, "of-grid-and-constant-R", false, {true, true}, grid_and_constant);
  add_slab(t, "of-eight-boxes-R", false, {}, [](SceneBuilder& builder) {
    const MediumIndex m = builder.homogeneous(rgb(1), kAlbedo);
    const BsdfIndex null = builder.null();
    for (int i = 0; i < 8; ++i)
      builder.container(
          CubeShape{},
          translate({i & 1 ? .3 : -.3, i & 2 ? .3 : -.3, i & 4 ? .75 : .25}) * scale(.3, .3, .25), null, m);
  });
  // In the lower half of the slab a medium of extinction 0.5 and higher priority replaces one of extinction
  // 1.5: their mean is 1.
  add_slab(t, "by-priority-R", false, {}, [](SceneBuilder& builder) {
    add_layer(builder, builder.homogeneous(rgb(1.5), kAlbedo));
    add_layer(builder, ranked(builder, rgb(.5), kAlbedo, 2), .5);
  });
}

// Overlapping media that scatter all light and absorb none, in a white sky. Every pixel is white, in
// whatever way the media overlap.
void white_crowd(Table& t) {
  SceneBuilder builder;
  const BsdfIndex null = builder.null();
  builder.container(SphereShape{}, {}, null, builder.homogeneous({.5, 1, 2}, rgb(1), .5));
  builder.container(CubeShape{}, translate({.6, .1, 0}) * scale(.9), null,
                    builder.homogeneous({2, .3, 1}, rgb(1), -.4));
  builder.container(
      CubeShape{}, scale(1.2), null,
      builder.heterogeneous(builder.grid({4, 4, 4}, patchy(64, 7), box({-1, -1, -1}, {1, 1, 1})), rgb(1), 1.5,
                            .8));
  builder.container(SphereShape{}, translate({0, .5, .4}) * scale(.5), null,
                    ranked(builder, {3, 3, 1}, rgb(1), 1));
  builder.environment();
  builder.look({.4, -6, .7}, {0, 0, 0}, 25);
  t.mean("7.6c-crowd-of-media/grid/volpath", "7.6c N69", "Four white media across each other in a white sky.",
         builder, grey(1), {.channels = true});
}

// Two media in one box that absorb, with extinctions s1 and s2, and emit e1 and e2 per length. Over a path of
// length d the radiance is (e1 + e2) (1 - e^(-(s1 + s2) d)) / (s1 + s2).
void emitting(Table& t, const Configuration& configuration) {
  SceneBuilder builder;
  const Rgb s1{.5, 1, .2}, s2{1, .25, .6}, e1{1, 2, 0}, e2{.5, 1, 3};
  const MediumIndex one = builder.homogeneous(s1, rgb(0)),
                    two = configuration.medium(builder, s2, rgb(0), 0, box({-1, -1, -1}, {1, 1, 1}));
  builder.set_emission(one, e1);
  builder.set_emission(two, e2);
  for (const MediumIndex m : {one, two}) builder.container(CubeShape{}, {}, builder.null(), m);
  builder.look({-5, .1, .2}, {0, .1, .2});
  Channels expected;
  for (std::size_t c = 0; c < 3; ++c)
    expected[c] = (e1[c] + e2[c]) * -std::expm1(-2 * (s1[c] + s2[c])) / (s1[c] + s2[c]);
  t.mean("7.6b-two-emitters-in-one-place" + configuration.name(), "7.6b N69",
         "Two media in one box that absorb and emit: their sums.", builder, expected);
}

// A lamp in two media in the same place; light is scattered once.
void lamp(Table& t) {
  constexpr double kHeight = .5, kSigma = 1;
  SceneBuilder builder;
  for (const double sigma : {.4, .6})
    builder.container(CubeShape{}, scale(3), builder.null(), builder.homogeneous(rgb(sigma), rgb(1)));
  builder.scene.emitters.push_back(PointEmitter{{0, 0, kHeight}, rgb(1 / (4 * kPi))});
  builder.scene.integrator.max_depth = kOnce;
  builder.look({-5, 0, 0}, {0, 0, 0});
  t.mean("7.6f-lamp-in-two-clouds/homogeneous/volpath", "7.6f N69",
         "A ray past a lamp through two media in one place: as through their sum.", builder,
         grey(passing_answer(kHeight, kSigma)));
}

}  // namespace

void add_overlaps(Table& t) {
  slabs_of_parts(t);
  white_crowd(t);
  for (const Configuration& configuration : both_media()) emitting(t, configuration);
  lamp(t);
}

}  // namespace ls::cases
