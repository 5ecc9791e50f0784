// Limits of what the materials of one scene may cost to build.
#include <gtest/gtest.h>

#include "tests/unit/bsdf/materials.h"
#include "worker/render/bsdf/material_builder.h"

namespace ls::render::test {
namespace {

TEST(MaterialLimits, NumberOfTablesIsLimited) {
  const Scene scene;
  const TextureTable textures;
  MaterialBuilder builder(scene, textures, {});
  int made = 0;
  const auto make = [&] { return ++made, CoatedConductorTables{}; };
  const auto add = [&](std::size_t i) { builder.coated_conductor({static_cast<float>(i), 0, 0, 0}, make); };

  for (std::size_t i = 0; i < MaterialBuilder::kMostTables; ++i) add(i);
  EXPECT_FALSE(builder.refused());
  add(0);  // its table is there already
  EXPECT_FALSE(builder.refused());

  EXPECT_EQ(builder.energy(MaterialBuilder::EnergyOf::conductor, Microfacet::ggx, .5, 1), nullptr);
  builder.coat(Microfacet::ggx, .5, 1.5);
  add(MaterialBuilder::kMostTables);

  ASSERT_TRUE(builder.refused());
  EXPECT_EQ(
      builder.error()->message,
      "the scene has more than 2048 rough materials whose roughness or index of refraction differs: round "
      "them, so that materials share their tables");
  EXPECT_EQ(made, static_cast<int>(MaterialBuilder::kMostTables));
}

}  // namespace
}  // namespace ls::render::test
