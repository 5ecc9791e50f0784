// Surfaces that let light pass or that lie on others: masks, thin sheets, plates, plastic, blends, and normal
// maps.
#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

constexpr double kSheet = 2 * .04 / 1.04;  // reflectance of a thin sheet of index 1.5 at normal incidence

BsdfIndex two_sided(SceneBuilder& builder, double reflectance) {
  const BsdfIndex one = builder.diffuse(reflectance);
  return builder.bsdf(TwoSidedBsdf{one, one});
}
BsdfIndex mask(SceneBuilder& builder, double opacity, BsdfIndex inner) {
  return builder.bsdf(MaskBsdf{builder.texture(rgb(opacity)), inner});
}
BsdfIndex thin_sheet(SceneBuilder& builder) {
  const TextureIndex white = builder.texture(rgb(1));
  return builder.bsdf(ThinDielectricBsdf{1.5, 1, white, white});
}
BsdfIndex third(SceneBuilder& builder) { return mask(builder, .3, two_sided(builder, 0)); }
BsdfIndex half(SceneBuilder& builder) { return mask(builder, .5, two_sided(builder, 0)); }
BsdfIndex plastic(SceneBuilder& builder, const Rgb& base) {
  const TextureIndex b = builder.texture(base), white = builder.texture(rgb(1));
  return builder.bsdf(PlasticBsdf{1.5, 1, true, b, white});
}
// Rough glass of alpha = 2e-3. Its facets are so flat that masking removes less than alpha^2 of the light.
BsdfIndex nearly_smooth(SceneBuilder& builder, Microfacet facets) {
  const TextureIndex white = builder.texture(rgb(1)), alpha = builder.texture(rgb(2e-3));
  return builder.bsdf(RoughDielectricBsdf{facets, alpha, alpha, 1.5, 1, white, white});
}

// The floor of floor_point() with a horizontal sheet of a material above it.
SceneBuilder floor_below(auto material) {
  SceneBuilder builder = floor_point();
  builder.shape(RectangleShape{}, translate({0, 0, 1}) * scale(3), material(builder));
  return builder;
}
// A white sky behind a shape with this material, seen along the shape's normal.
SceneBuilder through(const Geometry& g, const Transform& to_world, BsdfIndex (*material)(SceneBuilder&)) {
  SceneBuilder builder;
  builder.shape(g, to_world, material(builder));
  builder.environment();
  builder.look({0, 0, 3}, {0, 0, 0}, 1e-3, {0, 1, 0});
  return builder;
}

void null_transmission(Table& t) {
  t.mean("7.6g-mask-before-the-sky", "7.6g", "A mask of .3 lets .7 of a white sky pass.",
         through(RectangleShape{}, scale(3), third), grey(.7), {.channels = true});
  const auto direct = [&](const char* name, SceneBuilder builder, double irradiance) {
    t.mean(std::string("7.6g-") + name, "7.6g",
           "Light on a floor below a mask or a sheet: what they let pass.", std::move(builder),
           reflected(irradiance), {.channels = true});
  };
  // Only shadow rays find a light at a point or in a single direction: BSDF sampling never hits it.
  direct("mask-below-a-point", with(floor_below(third), PointEmitter{{.5, 0, 2}, rgb(3)}),
         .7 * 3 * 2 / std::pow(4.25, 1.5));
  direct("sheet-below-the-sun", with(floor_below(thin_sheet), DirectionalEmitter{{0, 0, -1}, rgb(2)}),
         2 * (1 - kSheet));
  // Both shadow rays and BSDF sampling find this light through the mask.
  direct("mask-below-a-sphere",
         with_lamp(floor_below(third), SphereShape{}, translate({0, 0, 3}) * scale(1.5)),
         .7 * kPi * 2.25 / 9);
  // A cube of side 2 with an absorbing medium inside; its faces are masks that let half of the light pass.
  // Light crosses two faces and a length of 2 in the medium.
  const Rgb sigma{1, .5, .25};
  Channels passed, lit;
  for (std::size_t c = 0; c < 3; ++c) {
    passed[c] = .25 * std::exp(-2 * sigma[c]);
    lit[c] = reflected(passed[c])[0];
  }
  SceneBuilder seen = through(CubeShape{}, {}, half);
  const MediumIndex m = seen.homogeneous(sigma, rgb(0));
  seen.scene.shapes[0].interior = m;
  seen.scene.shapes[0].is_medium_transition = true;
  t.mean("7.6g-mask-around-a-medium/homogeneous/volpath", "7.6g 7.6a",
         "The sky through two masks of a half and the absorber between them.", seen, passed,
         {.band = .03, .why_band = "a thirtieth of the light gets through, by chance"});
  SceneBuilder shadow = floor_point();
  shadow.container(CubeShape{}, translate({0, 0, 2.5}), half(shadow), shadow.homogeneous(sigma, rgb(0)));
  shadow.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, rgb(1)});
  t.mean("7.6g-mask-around-a-medium/homogeneous/shadow", "7.6g 7.6a",
         "The sun on a floor below two masks of a half and the absorber between them.", shadow, lit);
}

void coated(Table& t) {
  const auto add = [&](const char* name, const Geometry& g, auto material, double slack = 0) {
    SceneBuilder builder;
    builder.shape(g, rotate_x(30) * rotate_y(20), material(builder));
    t.mean(std::string("7.6c-") + name, "7.6c N64", "What absorbs nothing is as bright as the sky.",
           furnace(builder, 10), grey(1), {.slack = slack, .channels = true});
  };
  add("sheet-cube", CubeShape{}, thin_sheet);
  add("masked-cube", CubeShape{}, [](SceneBuilder& k) { return mask(k, .4, two_sided(k, 1)); });
  add("white-plastic", SphereShape{}, [](SceneBuilder& k) { return plastic(k, rgb(1)); });
  add("blend-of-mirror-and-white", CubeShape{}, [](SceneBuilder& k) {
    return k.bsdf(BlendBsdf{k.texture(rgb(.3)), k.mirror(), two_sided(k, 1)});
  });
  add("blend-with-a-mask", CubeShape{}, [](SceneBuilder& k) {
    return k.bsdf(BlendBsdf{k.texture(rgb(.3)), mask(k, .2, k.mirror()), two_sided(k, 1)});
  });
  add(
      "nearly-smooth-glass", SphereShape{}, [](SceneBuilder& k) { return nearly_smooth(k, Microfacet::ggx); },
      2e-4);
}

// Two cases in front of a black wall: a thin sheet, and a plate whose two faces consist of the glass of
// nearly_smooth(). The facets of this glass deflect light by about alpha = 2e-3 rad. Near normal incidence
// the Fresnel reflectances depend on the square of the angle, so they change by a share of the order of
// alpha^2.
void sheets(Table& t) {
  const auto add = [&](const char* name, SceneBuilder builder, double slack) {
    builder.shape(RectangleShape{}, translate({0, 0, -2}) * scale(20), builder.diffuse(0));
    t.mean(std::string("7.6g-") + name, "7.6g N36", "What a sheet of two faces reflects of a white sky.",
           builder, grey(kSheet),
           {.band = .02,
            .why_band = "a thirteenth of the light is reflected, by chance",
            .slack = slack,
            .channels = true});
  };
  add("sheet-before-black", through(RectangleShape{}, scale(3), thin_sheet), 0);
  add("nearly-smooth-plate",
      through(CubeShape{}, scale(9, 9, .25),
              [](SceneBuilder& k) { return nearly_smooth(k, Microfacet::beckmann); }),
      1e-4);
}

// Plastic of index n, lit along its normal and seen at i = 60 degrees from it. With t the angle of
// refraction, the amplitudes of Fresnel reflection are
//   r_s = (cos i - n cos t) / (cos i + n cos t),
//   r_p = (n cos i - cos t) / (n cos i + cos t).
void plastic_by_the_sun(Table& t) {
  const double n = 1.5, ci = .5, ct = std::sqrt(1 - .75 / (n * n));
  const double rs = (ci - n * ct) / (ci + n * ct), rp = (n * ci - ct) / (n * ci + ct);
  const double through = .96 * (1 - (rs * rs + rp * rp) / 2) / (n * n), r = 1 - (1 - walsh(n)) / (n * n);
  SceneBuilder builder;
  builder.shape(RectangleShape{}, scale(3), plastic(builder, {.2, .5, .8}));
  builder.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, rgb(1)});
  builder.scene.integrator.max_depth = kOnce;
  builder.look({-std::sqrt(3.), 0, 1}, {0, 0, 0}, 1e-3);
  const auto f = [&](double d) { return d / (1 - d * r) * through / kPi; };
  t.mean("7.6g-plastic-by-the-sun", "7.6g", "Plastic of three colours: light reflected within it included.",
         builder, {f(.2), f(.5), f(.8)});
}

// A grey floor whose normal map tilts the shading normal by 36.87 degrees, lit from straight above: the
// cosine between light and shading normal is 0.8. The bumps that a normal map describes cast no shadows.
void normal_map(Table& t) {
  SceneBuilder builder;
  const BsdfIndex floor = builder.diffuse(.5);
  builder.shape(RectangleShape{}, scale(3),
                builder.bsdf(NormalMapBsdf{builder.texture({.8, .5, .9}), floor, true, false}));
  builder.scene.integrator.max_depth = kOnce;
  builder.look({2, 1, 1}, {0, 0, 0}, 1e-3);
  t.mean("7.6g-normal-map-by-the-sun", "7.6g N37", "A floor whose normals lean: the cosine is theirs.",
         with(builder, DirectionalEmitter{{0, 0, -1}, rgb(1)}), reflected(.8), {.channels = true});
  // The sphere has radius r = 1 and lies at distance d = 3 in the direction of the leaning normal, all of it
  // above the floor and above the plane perpendicular to that normal. So the irradiance is pi r^2 / d^2.
  t.mean("7.6g-normal-map-by-a-sphere", "7.6g N37", "A floor whose normals lean towards a shining sphere.",
         with_lamp(builder, SphereShape{}, translate({1.8, 0, 2.4})), reflected(kPi / 9), {.channels = true});
}

}  // namespace

void add_coatings(Table& t) {
  null_transmission(t);
  coated(t);
  sheets(t);
  plastic_by_the_sun(t);
  normal_map(t);
}

}  // namespace ls::cases
