// Microfacet densities at roughness 1e-3, where the peak exceeds 1e5, and shading normals that differ from
// the geometric one.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"
#include "validation/measure/measure.h"

namespace ls::cases {
namespace {

constexpr double kSlant = 30;  // angle between the viewing direction and the normal, in degrees

// A white metal in the plane z = 0, seen by parallel rays and lit by a directional light. The half vector
// between the directions to camera and light is at the angle `off` (radians) from the normal. `alpha` is the
// roughness.
SceneBuilder glint(double alpha, Microfacet d, double off) {
  SceneBuilder builder;
  const TextureIndex a = builder.texture(rgb(alpha));
  builder.shape(RectangleShape{}, scale(10),
                builder.bsdf(RoughConductorBsdf{d, a, a, {0, 0, 0}, {1, 1, 1}, builder.texture(rgb(1))}));
  const double view = kSlant * kPi / 180, light = view + 2 * off;
  builder.scene.emitters.push_back(DirectionalEmitter{{std::sin(light), 0, -std::cos(light)}, rgb(1)});
  builder.scene.integrator.max_depth = kOnce;
  builder.look({5 * std::sin(view), 0, 5 * std::cos(view)}, {0, 0, 0}, 1e-3, {0, 1, 0});
  builder.scene.sensor.projection = Projection::orthographic;
  builder.scene.sensor.to_world = builder.scene.sensor.to_world * scale(.01, .01, 1);
  return builder;
}

// Returns the masking-shadowing factor G of GGX (Smith's, separable) at the angles of view and light, in
// radians. For Beckmann, G is 1 here to all digits.
double unmasked(double alpha, double view, double light) {
  const auto lambda = [alpha](double angle) {
    return (std::sqrt(1 + std::pow(alpha * std::tan(angle), 2)) - 1) / 2;
  };
  return 1 / ((1 + lambda(view)) * (1 + lambda(light)));
}

// The answer is D G E / (4 cos v): D is the density of facet normals at the half vector, G the
// masking-shadowing factor, E = 1 the irradiance perpendicular to the light, and v the angle of the view.
void peaks(Table& t) {
  for (const auto d : {Microfacet::ggx, Microfacet::beckmann})
    for (const double alpha : {2e-3, .01, .1})
      for (const int slopes : {0, 3}) {  // the half vector's slope (tangent of its angle), divided by alpha
        const double tangent = slopes * alpha, s2 = static_cast<double>(slopes * slopes),
                     view = kSlant * kPi / 180, off = std::atan(tangent);
        const bool ggx = d == Microfacet::ggx;
        const double shape =
                         ggx ? std::pow(1 + s2, -2) * unmasked(alpha, view, view + 2 * off) : std::exp(-s2),
                     density = shape * std::pow(1 + tangent * tangent, 2) / (kPi * alpha * alpha);
        // Directions are accurate to 2^-24, so slopes divided by alpha are accurate to 2^-24 / alpha. D
        // depends on the square of this slope.
        const double tolerance = 1e-5 + 2. * slopes * 4 * 0x1p-24 / alpha;
        t.exact(
            fmt::format("N34-{}-alpha-{:g}-{}", ggx ? "ggx" : "beckmann", alpha,
                        slopes > 0 ? "tail" : "peak"),
            "N34 N33", "The density of facets at its peak, and three slopes from it: by slopes, not cosines.",
            [=](const Bench& b) {
              return every_value(b, glint(alpha, d, off), 4, grey(density / (4 * std::cos(view))), tolerance);
            });
      }
}

// A floor whose shading normals lean by 80 degrees towards +x.
constexpr double kLean = 80 * kPi / 180;
SceneBuilder leaning() {
  SceneBuilder builder;
  MeshShape m;
  m.file = builder.asset("floor.obj",
                         "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn .984807753 0 .173648178\n"
                         "f 1//1 2//1 3//1\nf 1//1 3//1 4//1\n");
  builder.shape(m, scale(4), builder.diffuse(1));
  builder.look({1, -3, 2}, {0, 0, 0}, 10);
  return builder;
}

void normals(Table& t) {
  t.exact("N37-light-from-behind", "N37",
          "Lights below a floor whose normals lean towards them: they don't shine through it.",
          [](const Bench& b) {
            SceneBuilder builder = leaning();
            builder.scene.emitters.push_back(PointEmitter{{5, 0, -.5}, rgb(100)});
            builder.lamp(SphereShape{}, translate({6, 0, -1.5}), rgb(10));
            return every_value(b, builder, 64, grey(0), 0);
          });
  // A white floor whose shading normals lean by b from the geometric normal receives light from the
  // directions that are above both the floor and the plane perpendicular to the shading normal. The projected
  // solid angle of these directions about the shading normal is pi (1 + cos b) / 2; that of a whole
  // hemisphere is pi.
  t.mean(
      "N37-furnace", "N37 N38", "That floor, white, in a white sky: it gives the part of it that it sees.",
      [] { return in_white(leaning()); }, grey((1 + std::cos(kLean)) / 2));
}

}  // namespace

void add_microfacets(Table& t) {
  peaks(t);
  normals(t);
}

}  // namespace ls::cases
