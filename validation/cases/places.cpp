// Coincident objects: faces in the same place, nested and overlapping media, cameras at a boundary or inside
// glass, and lights that also reflect light. Also cases of defocus. Splitting a medium into parts that touch,
// or into thinner media in the same place, must not change the light.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr double kDepth = 1;
Channels lit(double depth) { return grey(std::exp(-depth) / (2 * kPi)); }

// Adds a box, given by its lower and upper corner, between the sun and a floor.
void add_box(SceneBuilder& builder, MediumIndex m, const Vec3& lo, const Vec3& hi) {
  builder.container(CubeShape{}, box(lo, hi) * box({.5, .5, .5}, {1, 1, 1}), builder.null(), m);
}

// The floor of lit_floor() below boxes of media. The light that is measured falls straight down the line
// x = y = 0: along an edge that four boxes share, or across the face between two boxes.
void faces_on_each_other(Table& t) {
  for (const Configuration& configuration : both_media()) {
    const auto medium = [configuration](SceneBuilder& builder, double sigma) {
      return configuration.medium(builder, rgb(sigma), rgb(0), 0, box({-1, -1, 1}, {1, 1, 2}));
    };
    t.exact("N41-eight-boxes" + configuration.name(), "N41 7.7",
            "A box of a medium as eight that share their faces; light runs along an edge of four.",
            [=](const Bench& b) {
              SceneBuilder builder = lit_floor();
              for (const double x : {-1., 0.})
                for (const double y : {-1., 0.})
                  for (const double z : {1., 1.5})
                    add_box(builder, medium(builder, kDepth), {x, y, z}, {x + 1, y + 1, z + .5});
              return every_value(b, builder, 16, lit(kDepth), 4e-6);
            });
    t.exact("N41-one-on-the-other" + configuration.name(), "N41",
            "Two media one on the other, their common face there twice: each counts on its side.",
            [=](const Bench& b) {
              SceneBuilder builder = lit_floor();
              add_box(builder, medium(builder, 1), {-1, -1, 1}, {1, 1, 1.25});
              add_box(builder, medium(builder, 3), {-1, -1, 1.25}, {1, 1, 2});
              return every_value(b, builder, 16, lit(.25 + 3 * .75), 4e-6);
            });
    t.exact("N69-two-halves-in-one-place" + configuration.name(), "N69 N41",
            "Two media of half the density in the same box are one of the whole.", [=](const Bench& b) {
              SceneBuilder builder = lit_floor();
              for (int i = 0; i < 2; ++i)
                add_box(builder, medium(builder, kDepth / 2), {-1, -1, 1}, {1, 1, 2});
              return every_value(b, builder, 16, lit(kDepth), 4e-6);
            });
    t.mean(
        "N69-seen-through-two-halves" + configuration.name(), "N69",
        "The same, seen through: by flights, of which the shorter one counts.",
        [=] {
          SceneBuilder builder = unit_cube(configuration, rgb(kDepth / 2));
          builder.container(CubeShape{}, translate({.5, .5, .5}) * scale(.5), builder.null(),
                            configuration.medium(builder, rgb(kDepth / 2), rgb(0), 0, Transform{}));
          builder.environment();
          return builder;
        },
        grey(std::exp(-kDepth)));
  }
}

// A pane that absorbs half the light, in the same place as the face of a box with a medium. A shadow ray may
// hit either surface first. The light must be attenuated both by the pane and by the medium.
void panes_on_faces(Table& t) {
  for (const Configuration& configuration : both_media())
    for (const bool first : {false, true})
      t.exact(
          fmt::format("N41-pane-{}-the-box-it-lies-on{}", first ? "before" : "after", configuration.name()),
          "N41",
          "A mask of 1/2 on the face of a medium: light takes both, whichever of them comes first in the "
          "scene.",
          [=](const Bench& b) {
            SceneBuilder builder = lit_floor();
            const BsdfIndex mask = builder.bsdf(MaskBsdf{builder.texture(rgb(.5)), builder.diffuse(0)});
            const Transform top = translate({0, 0, 2});
            if (first) builder.shape(RectangleShape{}, top, mask);
            add_box(builder,
                    configuration.medium(builder, rgb(kDepth), rgb(0), 0, box({-1, -1, 1}, {1, 1, 2})),
                    {-1, -1, 1}, {1, 1, 2});
            if (!first) builder.shape(RectangleShape{}, top, mask);
            return every_value(b, builder, 16, grey(.5 * lit(kDepth)[0]), 4e-6);
          });
}

// The walls emit L = 1 and reflect rho = 1/2, so the radiance is L + rho L + rho^2 L ... = 2. The emitting
// shape and the reflecting one coincide, so sampled directions that hit the wall must also find the light.
void lights_on_walls(Table& t) {
  for (const bool first : {false, true})
    t.mean(
        fmt::format("N41-light-{}-the-wall-it-lies-on", first ? "before" : "after"), "N41 N27",
        "A room of reflectance 1/2 whose walls are lit by a light without a material, in the same place: 2.",
        [=] {
          SceneBuilder builder;
          const BsdfIndex wall = builder.diffuse(.5), null = builder.null();
          const TextureIndex radiance = builder.texture(rgb(1));
          for (const bool light : {first, !first}) {
            Shape& s = builder.shape(CubeShape{}, {}, light ? null : wall);
            s.flip_normals = true;
            if (light) s.emitter = AreaEmitter{radiance};
          }
          builder.look({.1, .2, -.3}, {1, .3, .4}, 60);
          return builder;
        },
        grey(2));
}

// A medium that emits 1 per length and has no extinction, seen by cameras just outside and just inside one of
// its faces. The answer is the length of the ray in the medium.
void cameras_at_a_boundary(Table& t) {
  for (const Configuration& configuration : both_media())
    for (const double x : {-1e-2, -1e-5, -1e-7, 1e-7, 1e-5, 1e-2})
      t.exact(fmt::format("N43-camera-at-{:g}{}", x, configuration.name()), "N43",
              "A camera just outside and just inside of a shining medium: the way that is left of it.",
              [=](const Bench& b) {
                SceneBuilder builder = unit_cube(configuration, rgb(0));
                builder.set_emission(MediumIndex{0}, rgb(1));
                if (x > 0) builder.scene.sensor.medium = MediumIndex{0};
                builder.look({x, .5, .5}, {x + 1, .5, .5});
                builder.scene.sensor.near_clip = 1e-9;
                return every_value(b, builder, 4, grey(1 - std::max(0., x)), 2e-6);
              });
  // In uniform light, the radiance inside glass of index n is n^2 times that in the air outside, however
  // often the light was reflected inside.
  const auto from_inside = [&](const char* name, const char* about, double expected, bool bubble) {
    t.exact(name, "N43 N64", about, [=](const Bench& b) {
      SceneBuilder builder;
      builder.shape(SphereShape{}, {}, builder.glass(1.5));
      if (bubble)
        builder.shape(SphereShape{}, translate({.2, 0, .1}) * scale(.3), builder.glass(1.5)).flip_normals =
            true;
      builder.environment();
      builder.look({.2, .05, .1}, {1, .3, .4}, 60);
      return every_value(b, builder, 16, grey(expected), 2e-5);
    });
  };
  from_inside("N43-inside-of-glass", "A camera in a ball of glass in a white sky: n^2.", 2.25, false);
  from_inside("N43-in-a-bubble-in-glass", "A camera in a bubble of air in a ball of glass: 1.", 1, true);
}

// Lights that also reflect, so that the shaded points lie on the light itself.
void on_lights(Table& t) {
  const auto alone = [&](const char* name, const Geometry& g) {
    t.exact(fmt::format("N27-on-a-shining-{}", name), "N27",
            "A light that reflects half, alone: its own light does not fall on it.", [=](const Bench& b) {
              SceneBuilder builder;
              builder.shape(g, {}, builder.diffuse(.5)).emitter = AreaEmitter{builder.texture(rgb(1))};
              builder.look({.4, -.3, 6}, {0, 0, 0}, 5, {0, 1, 0});
              return every_value(b, builder, 64, grey(1), 0);
            });
  };
  alone("disk", DiskShape{});
  alone("square", RectangleShape{});
  alone("sphere", SphereShape{});
  alone("cube", CubeShape{});
}

// A small disk of radiance 1 and radius rho at distance z, out of focus: the focus distance is f, the lens
// radius R. The disk appears as a circle of confusion, of the diameter 2 R |z - f| / z at the focus distance.
// In the middle of this circle, only rays from the part of the lens within r = rho / |1 - z / f| of its
// centre hit the disk. So the radiance there is (r / R)^2.
void out_of_focus(Table& t) {
  constexpr double kAperture = .1, kFocus = 4, kDisk = .02;
  for (const double z : {2., 3., 8.}) {
    const double circle = 2 * kAperture * std::abs(z - kFocus) / z, disk = 2 * kDisk * kFocus / z;
    t.mean(
        fmt::format("N47-circle-of-confusion-at-{:g}", z), "N47 7.6g",
        "A disk that is not in focus: spread over a circle of 2 R |z - f| / z.",
        [=] {
          SceneBuilder builder;
          builder.lamp(DiskShape{}, translate({0, 0, z}) * rotate_x(180) * scale(kDisk));
          builder.look({0, 0, 0}, {0, 0, 1}, 1e-4, {0, 1, 0});
          builder.scene.sensor.aperture_radius = kAperture;
          builder.scene.sensor.focus_distance = kFocus;
          return builder;
        },
        grey(std::pow(disk / circle, 2)));
  }
}

constexpr Rgb kAlbedo{.9, .9, .9};

// Adds a case of an endless slab of optical depth 1 and albedo .9. `fill` adds the boxes of media that form
// the slab between the mirrors.
void add_slab(Table& t, const std::string& name, bool transmitted, const Configuration& configuration,
              auto fill) {
  SceneBuilder builder = empty_column({.albedo = .9, .tau = 1, .wall = .5}, transmitted);
  configuration.choose(builder);
  fill(builder);
  t.mean(fmt::format("N69-slab-{}{}", name, configuration.name()), "N69 7.2",
         "A slab of albedo .9 made of media in one place, or of boxes that touch: as one of them.", builder,
         grey(transmitted ? .591625 : .267410), {.slack = 2e-5});
}
// Adds a box a little wider than the column, from z = 0 up to `height`.
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
  // A homogeneous medium and a grid in the same place. Both integrators must sample both media, also
  // volpath_distant_mis, which samples light along whole segments.
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
  // Extinction 1.5 fills the slab. In its lower half, a medium of extinction 0.5 and higher priority replaces
  // it, so the mean extinction is 1.
  add_slab(t, "by-priority-R", false, {}, [](SceneBuilder& builder) {
    add_layer(builder, builder.homogeneous(rgb(1.5), kAlbedo));
    add_layer(builder, ranked(builder, rgb(.5), kAlbedo, 2), .5);
  });
}

// Overlapping media that scatter and do not absorb, in a white sky. Every pixel has the radiance of the sky,
// in whatever way the media overlap.
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
  t.mean("7.6c-crowd-of-media/grid/volpath", "7.6c N69", "Four white media across each other in a white sky.",
         furnace(builder, 25), grey(1), {.channels = true});
}

// Two media in the same box that absorb, with extinctions s1 and s2, and emit e1 and e2 per length. Over a
// path of length d the radiance is (e1 + e2) (1 - e^(-(s1 + s2) d)) / (s1 + s2).
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

void add_places(Table& t) {
  faces_on_each_other(t);
  panes_on_faces(t);
  lights_on_walls(t);
  cameras_at_a_boundary(t);
  on_lights(t);
  out_of_focus(t);
}

void add_overlaps(Table& t) {
  slabs_of_parts(t);
  white_crowd(t);
  for (const Configuration& configuration : both_media()) emitting(t, configuration);
  lamp(t);
}

}  // namespace ls::cases
