// Nori's rough plastic, as scenes of Nori are read: kd / pi + (1 - max kd) D F G / (4 cos cos).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "formats/read.h"
#include "tests/unit/bsdf/materials.h"

namespace ls::render::test {
namespace {

class AnyFile final : public AssetSource {
 public:
  Result<Asset> find(std::string_view name) override { return Asset{std::string(name), {}, 1}; }
  Result<std::string> text(std::string_view) override { return fail(Errc::not_found, "no file"); }
};

Scene wearing(const std::string& bsdf) {
  AnyFile files;
  const ReadResult r = read_scene("test.xml",
                                  "<scene><integrator type=\"path_mis\"/><camera type=\"perspective\"/><mesh "
                                  "type=\"sphere\">" +
                                      bsdf + "</mesh></scene>",
                                  files);
  EXPECT_TRUE(r.scene) << format_diagnostics(r.diagnostics);
  return r.scene.value_or(Scene{});
}

// The specular term from its definitions, in double: Beckmann's D, Smith's exact G1 (Walter et al. 2007, eq.
// 25), and Fresnel's equations for light from outside with n >= 1.
double gloss(const V3& i, const V3& o, double alpha, double n) {
  const auto smith = [&](const V3& v) {
    const double t = std::sqrt(1 - double{v.z} * v.z) / v.z;
    if (t == 0) return 1.0;
    const double a = 1 / (alpha * t);
    return 2 / (1 + std::erf(a) + std::exp(-a * a) / (a * std::sqrt(M_PI)));
  };
  const double hx = double{i.x} + o.x, hy = double{i.y} + o.y, hz = double{i.z} + o.z;
  const double length = std::sqrt(hx * hx + hy * hy + hz * hz), c = hz / length;
  const double D = std::exp((1 - 1 / (c * c)) / (alpha * alpha)) / (M_PI * alpha * alpha * c * c * c * c);
  const double ci = (i.x * hx + i.y * hy + i.z * hz) / length, ct = std::sqrt(1 - (1 - ci * ci) / (n * n));
  const double rs = (ci - n * ct) / (ci + n * ct), rp = (n * ci - ct) / (n * ci + ct);
  return D * (rs * rs + rp * rp) / 2 * smith(i) * smith(o) / (4 * double{i.z} * o.z);
}

V3 at(double theta, double phi) {
  return V3(static_cast<float>(std::sin(theta) * std::cos(phi)),
            static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta)));
}

void expect_model(const Bench& b, const Rgb& kd, double alpha, double n) {
  const double ks = 1 - *std::max_element(kd.begin(), kd.end());
  for (const double theta : {.1, .6, 1.1, 1.4})
    for (const double phi : {0., 1., 3.}) {
      const V3 o = at(.5, .3), i = at(theta, phi);
      const C3 f = b.eval(o, i).f_cos;
      for (int k = 0; k < 3; ++k) {
        const double wanted = (kd[static_cast<std::size_t>(k)] / M_PI + ks * gloss(i, o, alpha, n)) * i.z;
        // The renderer's G1 is a rational fit with an error of 0.35 %, and enters twice.
        EXPECT_NEAR((&f.x)[k], wanted, .0071 * wanted) << theta << " " << phi;
      }
      EXPECT_EQ(b.eval(o, V3(i.x, i.y, -i.z)).f_cos, C3(0));
      EXPECT_EQ(b.eval(V3(o.x, o.y, -o.z), V3(i.x, i.y, -i.z)).f_cos, C3(0));  // its back is black
    }
}

TEST(NoriMicrofacet, MatchesItsFormula) {
  const auto b = bench(wearing(
      R"(<bsdf type="microfacet"><float name="alpha" value="0.3"/><float name="intIOR" value="1.8"/>
         <float name="extIOR" value="1.2"/><color name="kd" value="0.2 0.6 0.4"/></bsdf>)"));
  expect_model(*b, {.2, .6, .4}, .3, 1.5);
}

TEST(NoriMicrofacet, EvaluatesItsTexturePerPoint) {
  ImageData image;
  image.width = image.height = 1;
  image.channels = 3;
  image.f32 = {.1f, .3f, .7f};
  const auto b = bench(
      wearing(
          R"(<bsdf type="microfacet_tex"><texture type="imagetexture" name="kd"><string name="filename" value="a.exr"/>
         <boolean name="srgb" value="false"/></texture><float name="intIOR" value="1.5"/><float name="extIOR" value="1"/></bsdf>)"),
      image);
  expect_model(*b, {.1, .3, .7}, .1, 1.5);
}

TEST(NoriMicrofacet, PeakAndHueReproduceTheTexture) {
  Scene s;
  s.textures = {ConstantTexture{{.2, .5, .25}}, ConstantTexture{{0, 0, 0}}, CheckerboardTexture{{0}, {1}, {}},
                PeakTexture{{2}}, PeakTexture{{2}, true}};
  const auto t =
      TextureTable::build(s, [](const Asset&) -> Result<ImageData> { return fail(Errc::not_found, ""); });
  ASSERT_TRUE(t) << t.error().message;
  EXPECT_EQ(t->eval({3}, {.1f, .1f}), C3(.5f));
  EXPECT_EQ(t->eval({4}, {.1f, .1f}), C3(.4f, 1, .5f));
  EXPECT_EQ(t->eval({3}, {.7f, .1f}), C3(0));
  // Black has no hue: the hue is white, and the peak 0.
  EXPECT_EQ(t->eval({4}, {.7f, .1f}), C3(1));
  s.textures = {PeakTexture{{1}}, PeakTexture{{0}}};
  EXPECT_FALSE(
      TextureTable::build(s, [](const Asset&) -> Result<ImageData> { return fail(Errc::not_found, ""); }));
}

}  // namespace
}  // namespace ls::render::test
