// Names of colour spaces of images: our own, and those of OpenColorIO's configurations of ACES and of
// MaterialX.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/schema/describe.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string bitmap_in(std::string_view space) {
  return with_sensor(
      fmt::format(R"(<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
<string name="filename" value="wood.png"/><string name="color_space" value="{}"/></texture></bsdf></shape>)",
                  space));
}
ImageColours read_as(std::string_view space) {
  const Scene scene = must_read(bitmap_in(space));
  return std::get<BitmapTexture>(scene.textures.at(0)).colours;
}

// All names and aliases of the colour spaces of cg-config-v2.1.0_aces-v1.3_ocio-v2.3, as OpenColorIO 2.4.2
// lists them, `Raw` excepted.
const std::pair<ImageColours, std::vector<std::string>> kOfOpenColorIo[] = {
    {ImageColours::aces2065_1, {"ACES2065-1", "aces2065_1", "ACES - ACES2065-1", "lin_ap0"}},
    {ImageColours::acescc, {"ACEScc", "ACES - ACEScc", "acescc_ap1"}},
    {ImageColours::acescct, {"ACEScct", "ACES - ACEScct", "acescct_ap1"}},
    {ImageColours::acescg, {"ACEScg", "ACES - ACEScg", "lin_ap1"}},
    {ImageColours::p3_d65,
     {"Linear P3-D65", "lin_p3d65", "Utility - Linear - P3-D65", "lin_displayp3", "Linear Display P3"}},
    {ImageColours::rec2020, {"Linear Rec.2020", "lin_rec2020", "Utility - Linear - Rec.2020"}},
    {ImageColours::rec709,
     {"Linear Rec.709 (sRGB)", "lin_rec709_srgb", "Utility - Linear - Rec.709", "lin_rec709", "lin_srgb",
      "Utility - Linear - sRGB"}},
    {ImageColours::g18_rec709,
     {"Gamma 1.8 Rec.709 - Texture", "g18_rec709_tx", "Utility - Gamma 1.8 - Rec.709 - Texture",
      "g18_rec709"}},
    {ImageColours::g22_ap1, {"Gamma 2.2 AP1 - Texture", "g22_ap1_tx", "g22_ap1"}},
    {ImageColours::g22_rec709,
     {"Gamma 2.2 Rec.709 - Texture", "g22_rec709_tx", "Utility - Gamma 2.2 - Rec.709 - Texture",
      "g22_rec709"}},
    {ImageColours::g24_rec709,
     {"Gamma 2.4 Rec.709 - Texture", "g24_rec709_tx", "g24_rec709", "rec709_display",
      "Utility - Rec.709 - Display"}},
    {ImageColours::srgb_ap1, {"sRGB Encoded AP1 - Texture", "srgb_encoded_ap1_tx", "srgb_ap1"}},
    {ImageColours::srgb_p3_d65,
     {"sRGB Encoded P3-D65 - Texture", "srgb_encoded_p3d65_tx", "srgb_p3d65", "srgb_displayp3"}},
    {ImageColours::srgb,
     {"sRGB - Texture", "srgb_tx", "Utility - sRGB - Texture", "srgb_texture",
      "Input - Generic - sRGB - Texture"}},
};

TEST(ImageColours, NamesOfOpenColorIoAreRead) {
  for (const auto& [colours, names] : kOfOpenColorIo)
    for (const std::string& name : names) EXPECT_EQ(read_as(name), colours) << name;
}

TEST(ImageColours, NamesOfMaterialXAreRead) {
  EXPECT_EQ(read_as("adobergb"), ImageColours::adobe);
  EXPECT_EQ(read_as("lin_adobergb"), ImageColours::adobe_linear);
  EXPECT_EQ(read_as("srgb_displayp3"), ImageColours::srgb_p3_d65);
}

TEST(ImageColours, UpperAndLowerCaseAreTheSame) {
  EXPECT_EQ(read_as("aces - acescg"), ImageColours::acescg);
  EXPECT_EQ(read_as("SRGB"), ImageColours::srgb);
}

TEST(ImageColours, SceneIsStoredWithOurOwnNames) {
  EXPECT_THAT(serialize(must_read(bitmap_in("ACES - ACEScg"))), HasSubstr(R"("color_space":"acescg")"));
  EXPECT_EQ(serialize(must_read(bitmap_in("lin_ap1"))), serialize(must_read(bitmap_in("acescg"))));
}

TEST(ImageColours, UnknownNameIsRefusedWithItsPlace) {
  const ReadResult read_result = read(bitmap_in("ARRI LogC4"));
  EXPECT_FALSE(read_result.scene);
  EXPECT_THAT(messages(read_result), HasSubstr("test.xml:3:"));
  EXPECT_THAT(messages(read_result), HasSubstr("'color_space' of"));
}

}  // namespace
}  // namespace ls
