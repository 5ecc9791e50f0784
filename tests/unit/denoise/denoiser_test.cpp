// The denoising program, with fake libraries instead of Open Image Denoise (tests/support/fake_oidn.cpp).
#include "util/denoise/denoiser.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ls {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string fake(const std::string& behaviour) {
  return (program_beside_us("../fake_oidn") / (behaviour + ".so")).string();
}

constexpr FrameSize kSize{3, 2};
NoisyImage image(float first) {
  NoisyImage out;
  for (int i = 0; i < 18; ++i) {
    out.color.push_back(first + static_cast<float>(i));
    out.albedo.push_back(static_cast<float>(i) / 32);
    out.normal.push_back(-static_cast<float>(i) / 64);
  }
  return out;
}

TEST(Denoiser, UsesTheGuidesOfEachImage) {
  const auto denoiser = Denoiser::find(2, fake("blurs"));
  ASSERT_TRUE(denoiser) << denoiser.error().message;
  EXPECT_EQ(denoiser->name(), "Open Image Denoise 2.99.7");
  const std::vector<NoisyImage> images = {image(0), image(100)};

  const auto denoised = denoiser->denoise(kSize, images);

  ASSERT_TRUE(denoised) << denoised.error().message;
  ASSERT_EQ(denoised->size(), 2u);
  for (const int which : {0, 1}) {
    const auto& color = images[static_cast<std::size_t>(which)].color;
    for (std::size_t c = 0; c < 3; ++c) {
      // Pixel (0, 0): the fake library computes the mean of four pixels, plus 1/16 of the guides, which it
      // has halved.
      const float mean = (color[c] + color[3 + c] + color[9 + c] + color[12 + c]) / 4,
                  guides = (static_cast<float>(c) / 32 - static_cast<float>(c) / 64) / 2;
      EXPECT_FLOAT_EQ((*denoised)[static_cast<std::size_t>(which)][c], mean + guides / 16);
    }
  }
}

TEST(Denoiser, SaysHowToInstallAMissingLibrary) {
  const auto denoiser = Denoiser::find(1, "/no/such/libOpenImageDenoise.so.2");

  ASSERT_FALSE(denoiser);
  EXPECT_EQ(denoiser.error().code, Errc::failed_precondition);
  EXPECT_THAT(denoiser.error().message,
              AllOf(HasSubstr("/no/such/libOpenImageDenoise.so.2"), HasSubstr("deploy/install-denoiser.sh")));
}

TEST(Denoiser, RefusesVersion1) {
  const auto denoiser = Denoiser::find(1, fake("old"));

  ASSERT_FALSE(denoiser);
  EXPECT_THAT(denoiser.error().message, HasSubstr("version 2 is needed"));
}

TEST(Denoiser, ReportsItsMissingProgram) {
  const auto denoiser = Denoiser::find(1, fake("blurs"), "/no/such/lightshaft-denoise");

  ASSERT_FALSE(denoiser);
  EXPECT_THAT(denoiser.error().message, HasSubstr("/no/such/lightshaft-denoise: No such file"));
}

TEST(Denoiser, StopsALibraryThatHangs) {
  const auto denoiser =
      Denoiser::find(1, fake("hangs"), program_beside_us("lightshaft-denoise"), /*least_seconds=*/1);
  ASSERT_TRUE(denoiser) << denoiser.error().message;
  const std::vector<NoisyImage> images = {image(0)};

  const auto denoised = denoiser->denoise(kSize, images);

  ASSERT_FALSE(denoised);
  EXPECT_EQ(denoised.error().code, Errc::resource_exhausted);
  EXPECT_THAT(denoised.error().message, HasSubstr("ended after 1 s"));
}

struct Fault {
  const char* library;
  const char* told;
};
class DenoiserFault : public ::testing::TestWithParam<Fault> {};

TEST_P(DenoiserFault, IsReportedAsAnError) {
  const auto denoiser = Denoiser::find(1, fake(GetParam().library));
  ASSERT_TRUE(denoiser) << denoiser.error().message;
  const std::vector<NoisyImage> images = {image(0)};

  const auto denoised = denoiser->denoise(kSize, images);

  ASSERT_FALSE(denoised);
  EXPECT_THAT(denoised.error().message, AllOf(HasSubstr("cannot denoise"), HasSubstr(GetParam().told)));
}

INSTANTIATE_TEST_SUITE_P(All, DenoiserFault,
                         ::testing::Values(Fault{"fails", "out of memory, says the stand-in"},
                                           Fault{"crashes", "was killed (Aborted)"},
                                           Fault{"cuts", "it cannot be cut short"},
                                           Fault{"nan", "not finite"}),
                         [](const auto& fault) { return std::string(fault.param.library); });

}  // namespace
}  // namespace ls
