// Which materials count as diffuse: on each side they have the same value for all viewers.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/bsdf/materials.h"
#include "worker/render/math/random.h"

namespace ls::render::test {
namespace {

BsdfIndex add_diffuse(Scene& s, double reflectance) { return add(s, DiffuseBsdf{texture(s, reflectance)}); }

BsdfIndex add_checkered(Scene& s) {
  CheckerboardTexture t;
  t.color0 = texture(s, .2);
  t.color1 = texture(s, .7);
  s.textures.push_back(t);
  return add(s, DiffuseBsdf{{static_cast<std::uint32_t>(s.textures.size() - 1)}});
}

bool is_diffuse(const Scene& scene) {
  const auto b = bench(scene);
  return b->bsdfs.is_diffuse(b->bsdf);
}

template <class Make>
Scene made(Make make) {
  Scene s;
  make(s);
  return s;
}

TEST(DiffuseMaterials, LookTheSameFromEverywhereOnOneSide) {
  const Scene scenes[] = {
      made([](Scene& s) { add_diffuse(s, .4); }),
      made([](Scene& s) { add_checkered(s); }),
      made([](Scene& s) {
        const BsdfIndex front = add_diffuse(s, .4), back = add_checkered(s);
        add(s, TwoSidedBsdf{front, back});
      }),
      made([](Scene& s) {
        add(s, DiffuseTransmissionBsdf{texture(s, .3), texture(s, .5)});
      }),
  };
  RandomStream dice(1);
  const auto direction = [&](float side) {
    V3 w(dice.uniform() - .5f, dice.uniform() - .5f, side * (dice.uniform() + .01f));
    return w.normalize();
  };
  for (const Scene& scene : scenes) {
    ASSERT_TRUE(is_diffuse(scene));
    const auto b = bench(scene);
    for (const float side : {1.f, -1.f})
      for (int i = 0; i < 20; ++i) {
        const V3 wi = direction(i % 2 ? 1.f : -1.f);
        const BsdfEval one = b->eval(direction(side), wi), other = b->eval(direction(side), wi);
        EXPECT_EQ(one.f_cos, other.f_cos);
        EXPECT_EQ(one.pdf, other.pdf);
        // The value is proportional to the cosine. Two products are rounded by half an ulp each
        const BsdfEval upright = b->eval(direction(side), {0, 0, std::copysign(1.f, wi.z)});
        for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(one.f_cos[c], upright.f_cos[c] * std::abs(wi.z));
        EXPECT_FLOAT_EQ(one.pdf, upright.pdf * std::abs(wi.z));
      }
  }
}

TEST(DiffuseMaterials, ExcludeViewDependentMaterials) {
  EXPECT_FALSE(is_diffuse(made([](Scene& s) {
    add(s, PlasticBsdf{.diffuse_reflectance = texture(s, .5), .specular_reflectance = texture(s, 1)});
  })));
  EXPECT_FALSE(is_diffuse(rough_metal(Microfacet::ggx, .3, .3, kGoldEta, kGoldK)));
  EXPECT_FALSE(is_diffuse(made([](Scene& s) {
    const BsdfIndex front = add_diffuse(s, .4);
    const BsdfIndex back =
        add(s, PlasticBsdf{.diffuse_reflectance = texture(s, .5), .specular_reflectance = texture(s, 1)});
    add(s, TwoSidedBsdf{front, back});
  })));
  EXPECT_FALSE(is_diffuse(made([](Scene& s) {
    const BsdfIndex inside = add_diffuse(s, .4);
    add(s, MaskBsdf{texture(s, .5), inside});
  })));
}

}  // namespace
}  // namespace ls::render::test
