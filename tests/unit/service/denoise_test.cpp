// Jobs with denoised layers, with a stand-in for Open Image Denoise (tests/support/fake_oidn.cpp).
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <thread>

#include "core/base/spawn.h"
#include "core/image/exr/exr_file.h"
#include "core/image/exr/final_image.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::filesystem::path fake(const std::string& behaviour) {
  return program_beside_us("../fake_oidn") / (behaviour + ".so");
}

std::unique_ptr<Coordinator> open_with(const std::filesystem::path& data,
                                       const std::filesystem::path& library) {
  Coordinator::Options options;
  options.data = data;
  options.denoiser = library.string();
  return Coordinator::open(std::move(options)).value();
}

JobSpec denoised_job(std::uint64_t spp = 16) {
  JobSpec spec;
  spec.spp = spp;
  spec.denoise = true;
  return spec;
}

FinalPicture image_of(const Coordinator& coordinator, const JobId& job) {
  return read_final_exr(coordinator.image_exr(job).value(), "image.exr").value();
}

const ExrHalf& half(const FinalPicture& image, const std::string& layer) {
  return std::get<ExrHalf>(image.channels.at(layer));
}

TEST(ServiceDenoise, AddsLayersToTheImageAndTheirErrorToTheReport) {
  TempFolder dir;
  for (const std::filesystem::path& data : {dir.path() / "disk", std::filesystem::path()}) {
    auto coordinator = open_with(data, fake("blurs"));
    const JobId job = submit(*coordinator, denoised_job());
    ASSERT_TRUE(finish(*coordinator, job, 2));

    const FinalPicture image = image_of(*coordinator, job);
    ASSERT_TRUE(image.changed && image.changed->empty()) << "the seal covers all layers";
    EXPECT_NE(half(image, "denoised.R").values, half(image, "R").values);
    EXPECT_TRUE(image.channels.contains("denoising_albedo.R"));
    const auto told = report(*coordinator, job);
    EXPECT_EQ(told["denoised"]["by"], "Open Image Denoise 2.99.7");
    EXPECT_EQ(image.strings.at("lightshaft:denoised_by"), "Open Image Denoise 2.99.7");
    const double relmse = told["denoised"]["relmse"];
    ASSERT_FALSE(told["denoised"]["relmse_ci95"].is_null());
    EXPECT_LE(told["denoised"]["relmse_ci95"][0], relmse);
    EXPECT_GE(told["denoised"]["relmse_ci95"][1], relmse);
    EXPECT_EQ(image.strings.at("lightshaft:denoised_relmse"), fmt::format("{:.9g}", relmse));
    EXPECT_TRUE(coordinator->job(job)->denoise);
  }
}

// Two jobs have the same pixels and different references. The denoised image may come from the cache, but
// each job gets the error against its own reference.
TEST(ServiceDenoise, TrueErrorUsesTheJobsReference) {
  TempFolder dir;
  for (const std::filesystem::path& data : {dir.path(), std::filesystem::path()}) {
    auto coordinator = open_with(data, fake("blurs"));
    const std::vector<float> levels = {.5F, 2.F};
    std::vector<JobId> jobs;
    for (const float level : levels) {
      ExrPicture grey{{40, 24}, {}, {}};
      for (const char* c : {"R", "G", "B"}) grey.channels[c] = ExrFloat{std::vector<float>(40 * 24, level)};
      const auto exr = write_exr(grey).value();
      JobSpec spec = denoised_job();
      spec.float_output = true;
      spec.reference = sha256(std::span<const std::byte>(exr));
      ASSERT_TRUE(coordinator->blobs().put(*spec.reference, exr));
      jobs.push_back(submit(*coordinator, spec));
    }
    ASSERT_TRUE(finish(*coordinator, jobs[0], 2) && finish(*coordinator, jobs[1], 2));

    EXPECT_EQ(pixels(*coordinator, jobs[0]), pixels(*coordinator, jobs[1]));
    for (std::size_t i = 0; i < 2; ++i) {
      const FinalPicture image = image_of(*coordinator, jobs[i]);
      double sum = 0;
      for (const char* layer : {"denoised.R", "denoised.G", "denoised.B"})
        for (const float v : std::get<ExrFloat>(image.channels.at(layer)).values)
          sum += (double{v} - levels[i]) * (double{v} - levels[i]);
      const double rmse = report(*coordinator, jobs[i])["denoised"]["true_rmse"];
      EXPECT_NEAR(rmse, std::sqrt(sum / (3 * 40 * 24)), 1e-12);  // the 2,880 terms are added in another order
    }
  }
}

// Denoising leaves the pixels and their digest as they are: those of a job that has only the denoiser's guide
// layers.
TEST(ServiceDenoise, DoesNotChangeTheImage) {
  auto coordinator = open_with({}, fake("blurs"));
  JobSpec plain = denoised_job();
  plain.denoise = false;
  plain.aov = {"denoising_albedo", "denoising_normal"};
  const JobId with = submit(*coordinator, denoised_job()), without = submit(*coordinator, plain);
  ASSERT_TRUE(finish(*coordinator, with, 2) && finish(*coordinator, without, 2));

  EXPECT_EQ(report(*coordinator, with)["pixels_sha256"], report(*coordinator, without)["pixels_sha256"]);
  EXPECT_FALSE(report(*coordinator, without).contains("denoised"));
}

TEST(ServiceDenoise, JobIsRejectedWithoutADenoiser) {
  auto coordinator = open_with({}, "/no/such/libOpenImageDenoise.so.2");

  const auto submitted = coordinator->submit({"test.xml", kSceneText, {}, denoised_job()});

  ASSERT_FALSE(submitted);
  EXPECT_EQ(submitted.error().error.code, Errc::failed_precondition);
  EXPECT_THAT(submitted.error().error.message, HasSubstr("deploy/install-denoiser.sh"));
  EXPECT_TRUE(coordinator->jobs().empty());
}

TEST(ServiceDenoise, LosingTheDenoiserCostsOnlyTheDenoisedLayers) {
  TempFolder dir;
  const auto library = dir.path() / "oidn.so";
  std::filesystem::copy_file(fake("blurs"), library);
  auto coordinator = open_with(dir.path() / "data", library);
  const JobId job = submit(*coordinator, denoised_job());
  std::filesystem::remove(library);
  ASSERT_TRUE(finish(*coordinator, job, 2));

  EXPECT_EQ(coordinator->job(job)->state, JobState::done);
  const FinalPicture image = image_of(*coordinator, job);
  EXPECT_FALSE(image.channels.contains("denoised.R"));
  EXPECT_FALSE(image.strings.contains("lightshaft:denoised_by"));
  EXPECT_THAT(report(*coordinator, job)["denoised"]["error"].get<std::string>(),
              AllOf(HasSubstr("oidn.so"), HasSubstr("LIGHTSHAFT_OIDN")));
}

TEST(ServiceDenoise, FinishedJobIsDenoisedAsANewJobWithItsSamples) {
  auto coordinator = open_with({}, fake("blurs"));
  JobSpec plain;
  plain.spp = 16;
  const JobId before = submit(*coordinator, plain);
  ASSERT_TRUE(finish(*coordinator, before));
  JobSpec changes;
  changes.denoise = true;

  const JobId job = coordinator->submit_again(before, changes, "").value();
  ASSERT_TRUE(finish(*coordinator, job));

  EXPECT_EQ(coordinator->job(job)->spp, 16u);
  EXPECT_TRUE(image_of(*coordinator, job).channels.contains("denoised.R"));
  EXPECT_FALSE(coordinator->job(before)->denoise);
}

TEST(ServiceDenoise, ExtendedJobIsDenoisedAgain) {
  TempFolder dir;
  auto coordinator = open_with(dir.path(), fake("blurs"));
  const JobId job = submit(*coordinator, denoised_job(4)), whole = submit(*coordinator, denoised_job(16));
  FakeFarm farm(*coordinator, 2);
  ASSERT_TRUE(farm.finish(job));
  const FinalPicture first = image_of(*coordinator, job);
  ASSERT_TRUE(extend(*coordinator, job, 16));
  ASSERT_TRUE(farm.finish(job) && farm.finish(whole));

  const FinalPicture extended = image_of(*coordinator, job);
  EXPECT_NE(half(extended, "denoised.G").values, half(first, "denoised.G").values);
  EXPECT_EQ(half(extended, "denoised.G").values, half(image_of(*coordinator, whole), "denoised.G").values);
}

TEST(ServiceDenoise, DenoisedImageIsShownWhileTheJobRenders) {
  auto coordinator = open_with({}, fake("blurs"));
  const JobId job = submit(*coordinator, denoised_job());
  EXPECT_TRUE(coordinator->image_png(job, {.denoised = true})) << "without a sample";
  FakeFarm farm(*coordinator, 1);
  farm.stop_after = 3;
  farm.run([] { return false; });
  while (coordinator->job(job)->units_done < 3) std::this_thread::yield();

  const auto shown = coordinator->image_png(job, {.denoised = true}), raw = coordinator->image_png(job);

  ASSERT_TRUE(shown && raw);
  EXPECT_NE(*shown, *raw);
  EXPECT_EQ(report(*coordinator, job)["denoised"], nullptr) << "not before it has ended";
}

TEST(ServiceDenoise, JobWithoutDenoiseHasNoDenoisedImage) {
  auto coordinator = open_with({}, fake("blurs"));
  JobSpec plain = denoised_job();
  plain.denoise = false;
  const JobId job = submit(*coordinator, plain);

  const auto none = coordinator->image_png(job, {.denoised = true});

  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, Errc::failed_precondition);
}

}  // namespace
}  // namespace ls::coordinator
