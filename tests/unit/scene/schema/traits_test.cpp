// Properties of media and emitters that follow from their parameters.
#include <gtest/gtest.h>

#include "core/scene/schema/traits.h"

namespace ls::scene {
namespace {

constexpr Rgb kBlack{0, 0, 0}, kGrey{.5, .5, .5}, kRed{1, 0, 0};
constexpr VolumeIndex kZero{0}, kOne{1}, kFile{2}, kColour{3};
const std::vector<Volume> kVolumes{ConstVolume{kBlack}, ConstVolume{kGrey}, GridVolume{}, ConstVolume{kRed}};

TEST(MediumTraits, HomogeneousMediumIsKnownByItsCoefficients) {
  const auto traits = [](const HomogeneousMedium& m) { return traits_of(m, kVolumes); };

  EXPECT_TRUE(traits({}).extinguishes);
  EXPECT_TRUE(traits({}).scatters);
  EXPECT_FALSE(traits({}).emits);
  EXPECT_FALSE(traits({}).chromatic);
  EXPECT_FALSE(traits({.scale = 0}).extinguishes);
  EXPECT_FALSE(traits({.scale = 0}).scatters);
  EXPECT_FALSE(traits({.albedo = kBlack}).scatters);
  EXPECT_TRUE(traits({.sigma_t = kRed}).chromatic);
  EXPECT_TRUE(traits({.scale = 0, .emission = kRed}).emits);
  EXPECT_TRUE(traits({.source_radiance = kRed}).emits);
  EXPECT_FALSE(traits({.scale = 0, .source_radiance = kRed}).emits) << "it is multiplied by the absorption";
}

TEST(MediumTraits, HeterogeneousMediumIsKnownIfItsVolumesAreConstant) {
  const auto traits = [](HeterogeneousMedium m) { return traits_of(m, kVolumes); };

  EXPECT_TRUE(traits({kFile, kOne}).extinguishes) << "the file may hold anything";
  EXPECT_TRUE(traits({kFile, kOne}).density_file);
  EXPECT_TRUE(traits({kOne, kFile}).scatters);
  EXPECT_FALSE(traits({kOne, kFile}).density_file);
  EXPECT_FALSE(traits({kOne, kZero}).scatters);
  EXPECT_FALSE(traits({kZero, kOne}).extinguishes);
  EXPECT_FALSE(traits({kZero, kOne}).scatters);
  EXPECT_TRUE(traits({kColour, kOne}).chromatic);
  EXPECT_TRUE(traits({kOne, kOne}).grids);
  EXPECT_TRUE(traits({.sigma_t = kZero, .albedo = kOne, .emission = kFile}).emits);
  EXPECT_FALSE(traits({.sigma_t = kFile, .albedo = kOne, .emission = kZero}).emits);
  EXPECT_FALSE(traits({.sigma_t = kFile, .albedo = kOne, .emission = kOne, .emission_scale = 0}).emits);
  EXPECT_TRUE(traits({.sigma_t = kFile, .albedo = kOne, .temperature = kFile}).emits);
  EXPECT_FALSE(traits({.sigma_t = kZero, .albedo = kOne, .temperature = kFile}).emits)
      << "it is multiplied by the absorption";
}

TEST(EmitterTraits, StateDarknessExtentAndPosition) {
  const std::vector<Texture> textures{ConstantTexture{kBlack}, ConstantTexture{kGrey}};
  const auto traits = [&](const Emitter& e) { return traits_of(e, textures); };
  Transform there;
  there.m[3] = 1, there.m[7] = 2, there.m[11] = 3;

  EXPECT_FALSE(traits(ConstantEmitter{}).dark);
  EXPECT_FALSE(traits(ConstantEmitter{}).delta);
  EXPECT_TRUE(traits(ConstantEmitter{kBlack}).dark);
  EXPECT_TRUE(traits(DirectionalEmitter{}).delta);
  EXPECT_FALSE(traits(DirectionalEmitter{.angular_radius = .25}).delta);
  EXPECT_EQ(traits(DirectionalEmitter{}).position, std::nullopt);
  EXPECT_EQ(traits(PointEmitter{.position = {4, 5, 6}}).position, (Vec3{4, 5, 6}));
  EXPECT_EQ(traits(SpotEmitter{.to_world = there}).position, (Vec3{1, 2, 3}));
  EXPECT_TRUE(traits(SpotEmitter{.texture = TextureIndex{0}}).dark);
  EXPECT_FALSE(traits(SpotEmitter{.texture = TextureIndex{1}}).dark);
  EXPECT_FALSE(traits(EnvmapEmitter{}).delta);
  EXPECT_TRUE(traits(EnvmapEmitter{.scale = 0}).dark);
  EXPECT_TRUE(traits(ProjectorEmitter{.irradiance = TextureIndex{0}}).dark);
  EXPECT_TRUE(traits(GoniometricEmitter{.texture = TextureIndex{0}}).dark);
  EXPECT_FALSE(traits(GoniometricEmitter{.texture = TextureIndex{1}}).dark);
  EXPECT_TRUE(traits(GoniometricEmitter{.intensity = kBlack, .texture = TextureIndex{1}}).dark);
  EXPECT_EQ(traits(GoniometricEmitter{.to_world = there, .texture = TextureIndex{1}}).position,
            (Vec3{1, 2, 3}));
}

}  // namespace
}  // namespace ls::scene
