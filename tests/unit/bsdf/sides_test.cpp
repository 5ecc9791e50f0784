// The analysis of a scene (bsdf_traits.h) treats the backs of some materials as black, and leaves out what
// only they could show. These backs must be black when rendered.
#include <gtest/gtest.h>

#include <random>

#include "core/scene/schema/describe_fields.h"
#include "core/scene/schema/traits.h"
#include "tests/unit/bsdf/materials.h"

namespace ls::render::test {
namespace {

// A material with default parameters, over a diffuse one if it contains others.
template <class Kind>
std::unique_ptr<Bench> plain() {
  Scene s = diffuse({.5, .5, .5});
  add(s, Kind{});
  return bench(std::move(s));
}

bool shows_its_back(const Bench& b) {
  std::mt19937 rng(3);
  const auto uniform = [&] { return static_cast<float>(rng() >> 8) * 0x1p-24f; };
  for (int i = 0; i < 1000; ++i) {
    const V3 wo = direction(-1 + .999 * double{uniform()}, 6 * double{uniform()});
    const float lobe = uniform(), x = uniform(), y = uniform();
    const auto s = b.sample(wo, lobe, {x, y});
    if (s && !is_black(s->weight)) return true;
  }
  return false;
}

template <class... Kinds>
void expect_black_backs(std::type_identity<std::variant<Kinds...>>) {
  const auto ask = []<class Kind>() {
    // A bump map needs an image as its texture. Its back is that of the material that it contains.
    if constexpr (!std::is_same_v<Kind, BumpMapBsdf>) {
      const auto b = plain<Kind>();
      const bool black = scene::bsdf_traits(b->scene)->back().black_behind;
      EXPECT_FALSE(black && shows_its_back(*b)) << scene::kInfo<Kind>.name << ": name it in bsdf_traits.cpp";
    }
  };
  (ask.template operator()<Kinds>(), ...);
}

TEST(Sides, SidesAssumedBlackAreBlack) { expect_black_backs(std::type_identity<Bsdf>{}); }

TEST(Sides, BothSidesOfGlassAndTwoSidedSurfacesAreVisible) {
  EXPECT_TRUE(shows_its_back(*plain<DielectricBsdf>()));
  EXPECT_TRUE(shows_its_back(*plain<TwoSidedBsdf>()));
  EXPECT_FALSE(shows_its_back(*plain<DiffuseBsdf>()));
}

}  // namespace
}  // namespace ls::render::test
