// Surfaces that let light pass, rough glass, plastic and mixtures.
#include <cmath>

#include "tests/statistical/case.h"

namespace ls::test {
namespace {

constexpr double kGreyReflectance = .5;
constexpr double kSheet = 2 * .04 / 1.04;  // a sheet of n = 1.5 seen from above reflects

BsdfIndex two_sided(SceneBuilder& builder, double reflectance) {
  const BsdfIndex one = builder.diffuse(reflectance);
  return builder.bsdf(TwoSidedBsdf{one, one});
}
BsdfIndex mask(SceneBuilder& builder, double opacity, BsdfIndex inner) {
  return builder.bsdf(MaskBsdf{builder.texture(rgb(opacity)), inner});
}
BsdfIndex sheet(SceneBuilder& builder, double ior) {
  const TextureIndex white = builder.texture(rgb(1));
  return builder.bsdf(ThinDielectricBsdf{ior, 1, white, white});
}

// The point of the floor at the origin seen from the side, below a sheet of something.
SceneBuilder floor_below(auto material) {
  SceneBuilder builder;
  const BsdfIndex grey = builder.diffuse(kGreyReflectance), above = material(builder);
  builder.shape(RectangleShape{}, scale(3), grey);
  builder.shape(RectangleShape{}, translate({0, 0, 1}) * scale(3), above);
  builder.scene.integrator.max_depth = 2;
  builder.look({-2, 1, .6}, {0, 0, 0}, 1e-3);
  return builder;
}
SceneBuilder through(auto material) {  // along the normal of a sheet, the sky behind it
  SceneBuilder builder;
  const BsdfIndex b = material(builder);
  builder.shape(RectangleShape{}, scale(3), b);
  builder.environment();
  builder.look({0, 0, 2}, {0, 0, 0}, 1e-3, {0, 1, 0});
  return builder;
}

void null_transmission(std::vector<Case>& cases) {
  const auto third = [](SceneBuilder& k) { return mask(k, .3, two_sided(k, 0)); };
  const auto glass = [](SceneBuilder& k) { return sheet(k, 1.5); };
  const auto direct = [&](const char* name, SceneBuilder builder, double irradiance) {
    cases.push_back({name, std::move(builder), grey(irradiance * kGreyReflectance / kPi), 2048, .01});
  };
  cases.push_back({"mask_before_the_sky", through(third), grey(.7), 4096});
  {
    // Shadow rays alone get there: no path finds a point or a direction.
    SceneBuilder builder = floor_below(third);
    builder.scene.emitters.push_back(PointEmitter{{.5, 0, 2}, rgb(3)});
    direct("mask_below_a_point", builder, .7 * 3 * 2 / std::pow(4.25, 1.5));
  }
  {
    SceneBuilder builder = floor_below(glass);
    builder.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, rgb(2)});
    direct("sheet_below_the_sun", builder, 2 * (1 - kSheet));
  }
  {
    // Both strategies: the light is found through the mask by shadow rays and by paths.
    SceneBuilder builder = floor_below(third);
    const TextureIndex one = builder.texture(rgb(1));
    const BsdfIndex black = builder.diffuse(0);
    builder.shape(SphereShape{}, translate({0, 0, 3}) * scale(1.5), black).emitter = AreaEmitter{one};
    direct("mask_below_a_sphere", builder, .7 * kPi * 2.25 / 9);
  }
  {
    // Two masks and an absorbing medium between them, for camera rays and for shadow rays.
    SceneBuilder builder = through([&](SceneBuilder& k) { return mask(k, .5, two_sided(k, 0)); });
    builder.scene.shapes.clear();
    builder.container(CubeShape{}, {}, {static_cast<std::uint32_t>(builder.scene.bsdfs.size() - 1)},
                      builder.homogeneous({1, .5, .25}, rgb(0)));
    builder.look({0, 0, 3}, {0, 0, 0}, 1e-3, {0, 1, 0});
    const auto t = [](double sigma) { return .25 * std::exp(-2 * sigma); };
    cases.push_back({"mask_around_a_medium", builder, {t(1), t(.5), t(.25)}, 16384, .03});
    SceneBuilder shadow = floor_below([](SceneBuilder& k) { return k.null(); });
    const BsdfIndex b = mask(shadow, .5, two_sided(shadow, 0));
    shadow.container(CubeShape{}, translate({0, 0, 2.5}), b, shadow.homogeneous({1, .5, .25}, rgb(0)));
    shadow.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, rgb(1)});
    const double f = kGreyReflectance / kPi;
    cases.push_back({"mask_around_a_medium_shadow", shadow, {f * t(1), f * t(.5), f * t(.25)}, 64});
  }
}

void furnaces(std::vector<Case>& cases) {
  const auto add = [&](const char* name, const Geometry& g, auto material, std::uint64_t spp,
                       double slack = 0) {
    SceneBuilder builder;
    const BsdfIndex b = material(builder);
    builder.shape(g, rotate_x(30) * rotate_y(20), b);
    builder.environment();
    builder.look({.4, -6, .7}, {0, 0, 0}, 10);
    Case c{name, builder, grey(1), spp};
    c.slack = slack;
    cases.push_back(std::move(c));
  };
  add(
      "furnace_sheet_cube", CubeShape{}, [](SceneBuilder& k) { return sheet(k, 1.5); }, 256);
  add(
      "furnace_masked_cube", CubeShape{}, [](SceneBuilder& k) { return mask(k, .4, two_sided(k, 1)); }, 256);
  add(
      "furnace_white_plastic", SphereShape{},
      [](SceneBuilder& k) {
        const TextureIndex white = k.texture(rgb(1));
        return k.bsdf(PlasticBsdf{1.5, 1, true, white, white});
      },
      1024);
  add(
      "furnace_blend_of_mirror_and_white", CubeShape{},
      [](SceneBuilder& k) {
        return k.bsdf(BlendBsdf{k.texture(rgb(.3)), k.mirror(), two_sided(k, 1)});
      },
      256);
  add(
      "furnace_blend_with_a_mask", CubeShape{},
      [](SceneBuilder& k) {
        return k.bsdf(BlendBsdf{k.texture(rgb(.3)), mask(k, .2, k.mirror()), two_sided(k, 1)});
      },
      256);
  // Facets as flat as these mask less than alpha^2 of the light.
  add(
      "furnace_nearly_smooth_glass", SphereShape{},
      [](SceneBuilder& k) {
        const TextureIndex white = k.texture(rgb(1)), alpha = k.texture(rgb(2e-3));
        return k.bsdf(RoughDielectricBsdf{Microfacet::ggx, alpha, alpha, 1.5, 1, white, white});
      },
      256, 2e-4);
}

void sheets(std::vector<Case>& cases) {
  const auto add = [&](const char* name, auto material, double expected, double slack) {
    SceneBuilder builder = through(material);
    const BsdfIndex black = builder.diffuse(0);
    builder.shape(RectangleShape{}, translate({0, 0, -2}) * scale(20), black);
    cases.push_back({name, builder, grey(expected), 8192, .02, slack});
  };
  add(
      "sheet_before_black", [](SceneBuilder& k) { return sheet(k, 1.5); }, kSheet, 0);
  {
    // The same from two rough faces, as flat as this: light turns by 2e-3, and Fresnel's terms by its square.
    SceneBuilder builder;
    const TextureIndex white = builder.texture(rgb(1)), alpha = builder.texture(rgb(2e-3));
    const BsdfIndex rough =
        builder.bsdf(RoughDielectricBsdf{Microfacet::beckmann, alpha, alpha, 1.5, 1, white, white});
    const BsdfIndex black = builder.diffuse(0);
    builder.shape(CubeShape{}, scale(9, 9, .25), rough);
    builder.shape(RectangleShape{}, translate({0, 0, -2}) * scale(20), black);
    builder.environment();
    builder.look({0, 0, 2}, {0, 0, 0}, 1e-3, {0, 1, 0});
    cases.push_back({"nearly_smooth_plate", builder, grey(kSheet), 8192, .02, 1e-4});
  }
}

// The diffuse reflectance of a plane boundary from outside (Walsh 1926).
double walsh(double n) {
  const double n2 = n * n, n4 = n2 * n2;
  return .5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1)) +
         n2 * (n2 - 1) * (n2 - 1) / std::pow(n2 + 1, 3) * std::log((n - 1) / (n + 1)) -
         2 * n2 * n * (n2 + 2 * n - 1) / ((n2 + 1) * (n4 - 1)) +
         8 * n4 * (n4 + 1) / ((n2 + 1) * (n4 - 1) * (n4 - 1)) * std::log(n);
}

void plastic(std::vector<Case>& cases) {
  // Lit along the normal, seen at 60 degrees from it, where r_s = (cos i - n cos t) / (cos i + n cos t) and
  // so on.
  const double n = 1.5, ci = .5, ct = std::sqrt(1 - .75 / (n * n));
  const double rs = (ci - n * ct) / (ci + n * ct), rp = (n * ci - ct) / (n * ci + ct);
  const double through = .96 * (1 - (rs * rs + rp * rp) / 2) / (n * n), r = 1 - (1 - walsh(n)) / (n * n);
  SceneBuilder builder;
  const TextureIndex base = builder.texture({.2, .5, .8}), white = builder.texture(rgb(1));
  const BsdfIndex b = builder.bsdf(PlasticBsdf{n, 1, true, base, white});
  builder.shape(RectangleShape{}, scale(3), b);
  builder.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, rgb(1)});
  builder.scene.integrator.max_depth = 2;
  builder.look({-std::sqrt(3.), 0, 1}, {0, 0, 0}, 1e-3);
  const auto f = [&](double d) { return d / (1 - d * r) * through / kPi; };
  cases.push_back({"plastic_by_the_sun", builder, {f(.2), f(.5), f(.8)}, 16});
}

void normal_map(std::vector<Case>& cases) {
  // A grey floor whose normal leans to the light by 36.87 degrees, lit from above: the cosine is .8. Bumps
  // cast no shadows on each other.
  SceneBuilder builder;
  const BsdfIndex grey_floor = builder.diffuse(kGreyReflectance);
  const BsdfIndex b = builder.bsdf(NormalMapBsdf{builder.texture({.8, .5, .9}), grey_floor, true, false});
  builder.shape(RectangleShape{}, scale(3), b);
  builder.scene.integrator.max_depth = 2;
  builder.look({2, 1, 1}, {0, 0, 0}, 1e-3);
  SceneBuilder sun = builder;
  sun.scene.emitters.push_back(DirectionalEmitter{{0, 0, -1}, rgb(1)});
  cases.push_back({"normal_map_by_the_sun", sun, grey(.8 * kGreyReflectance / kPi), 16});
  // A sphere in the normal's direction, whole above the surface and above the leaning plane: E = pi r^2 /
  // d^2.
  const TextureIndex one = builder.texture(rgb(1));
  const BsdfIndex black = builder.diffuse(0);
  builder.shape(SphereShape{}, translate({1.8, 0, 2.4}) * scale(1), black).emitter = AreaEmitter{one};
  cases.push_back({"normal_map_by_a_sphere", builder, grey(kGreyReflectance / 9), 1024});
}

}  // namespace

void add_materials(std::vector<Case>& cases) {
  null_transmission(cases);
  furnaces(cases);
  sheets(cases);
  plastic(cases);
  normal_map(cases);
}

}  // namespace ls::test
