// Jobs whose target error is that of their denoised layers, through the whole coordinator, with a stand-in
// for Open Image Denoise (tests/support/fake_oidn.cpp).
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "coordinator/views/views.h"
#include "core/base/spawn.h"
#include "core/image/exr/final_image.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

// A denoiser that returns its input: the error of the denoised image falls like that of the image itself.
std::filesystem::path copying() { return program_beside_us("../fake_oidn") / "copies.so"; }

std::unique_ptr<Coordinator> open_denoised(const std::filesystem::path& data,
                                           const std::filesystem::path& library = copying()) {
  Coordinator::Options options;
  options.data = data;
  options.denoiser = library.string();
  return Coordinator::open(std::move(options)).value();
}

JobSpec spec_with(double target) {
  JobSpec spec;
  spec.size = FrameSize{96, 72};
  spec.target_error = target;
  spec.target_layer = TargetLayer::denoised;
  spec.denoise = true;
  return spec;
}

struct TargetOutcome {
  std::string pixels, stopped;
  nlohmann::json checks;
  bool operator==(const TargetOutcome&) const = default;
};
TargetOutcome target_outcome(const Coordinator& coordinator, const JobId& job) {
  const auto j = report(coordinator, job);
  return {j.value("pixels_sha256", ""), j["stopped"].is_string() ? j.value("stopped", "") : "",
          j["denoised_checks"]};
}

TargetOutcome target_at_once(const JobSpec& spec) {
  auto coordinator = open_denoised({});
  const JobId job = submit(*coordinator, spec);
  FakeFarm farm(*coordinator, 1);
  EXPECT_TRUE(farm.finish(job));
  return target_outcome(*coordinator, job);
}

// Target errors that the fake's images reach, taken from the checks of a job whose target is too small to be
// reached.
struct Targets {
  double loose = 0, tight = 0;
};
Targets find_targets() {
  JobSpec spec = spec_with(1e-9);
  spec.spp = 600;
  const TargetOutcome out = target_at_once(spec);
  EXPECT_EQ(out.stopped, "spp");
  EXPECT_GE(out.checks.size(), 6u);
  for (std::size_t i = 1; i < out.checks.size(); ++i)
    EXPECT_LT(out.checks[i]["at_most"].get<double>(), out.checks[i - 1]["at_most"].get<double>());
  return {out.checks[1]["at_most"], out.checks[4]["at_most"]};
}
const Targets& targets() {
  static const Targets all = find_targets();
  return all;
}

TEST(DenoisedJob, EndsWhenTwoChecksMeetTheTargetAndExplainsIt) {
  auto coordinator = open_denoised({});
  const JobId job = submit(*coordinator, spec_with(targets().tight));
  FakeFarm farm(*coordinator, 2);
  ASSERT_TRUE(farm.finish(job));

  const auto j = report(*coordinator, job);
  EXPECT_EQ(j["stopped"], "error");
  EXPECT_EQ(j["target_layer"], "denoised");
  EXPECT_THAT(j["note"].get<std::string>(), HasSubstr("denoised layers"));
  EXPECT_NE(j["relmse"], j["denoised"]["relmse"]) << "that of the image itself";
  const auto& checks = j["denoised_checks"];
  ASSERT_GE(checks.size(), 3u);
  const auto meets = [&](std::size_t i) { return checks[i]["at_most"].get<double>() <= targets().tight; };
  for (std::size_t i = 1; i < checks.size(); ++i)
    EXPECT_EQ(meets(i - 1) && meets(i), i + 1 == checks.size()) << i;
  EXPECT_EQ(checks.back()["spp"], j["spp"]) << "the last check is of the image";
  EXPECT_EQ(checks.back()["relmse"], j["denoised"]["relmse"]);
  EXPECT_TRUE(j["forecast"].is_null() || !j["forecast"]["asked"].get<bool>());
  const auto view = nlohmann::json::parse(job_json(*coordinator->job(job)));
  EXPECT_EQ(view["target_layer"], "denoised");
  EXPECT_EQ(view["denoised_check"], checks.back());
  const auto image = read_final_exr(coordinator->image_exr(job).value(), "image.exr").value();
  EXPECT_EQ(image.strings.at("lightshaft:target_layer"), "denoised");
  EXPECT_TRUE(image.channels.contains("denoised.R"));
}

TEST(DenoisedJob, ShuffledResultsAndAKilledCoordinatorGiveTheSamePixelsAndChecks) {
  const TargetOutcome expected = target_at_once(spec_with(targets().tight));
  for (const int k : {1, 30, 50, 60}) {
    TempFolder dir;
    std::mt19937 random(static_cast<unsigned>(k));
    const auto shuffle = [&](auto& units) { std::shuffle(units.begin(), units.end(), random); };
    JobId job;
    {
      auto coordinator = open_denoised(dir.path());
      job = submit(*coordinator, spec_with(targets().tight));
      FakeFarm farm(*coordinator, 2);
      farm.reorder = shuffle;
      farm.stop_after = k;
      EXPECT_FALSE(farm.finish(job)) << "the job ends before result " << k;
    }
    auto coordinator = open_denoised(dir.path());
    FakeFarm farm(*coordinator, 3);
    farm.reorder = shuffle;
    ASSERT_TRUE(farm.finish(job)) << k;
    EXPECT_EQ(target_outcome(*coordinator, job), expected) << k;
  }
}

TEST(DenoisedJob, LoweredTargetGivesTheBitsOfAJobSubmittedWithIt) {
  const TargetOutcome expected = target_at_once(spec_with(targets().tight));
  for (const bool restarted : {false, true}) {
    TempFolder dir;
    auto coordinator = open_denoised(dir.path());
    const JobId job = submit(*coordinator, spec_with(targets().loose));
    {
      FakeFarm farm(*coordinator, 2);
      ASSERT_TRUE(farm.finish(job));
    }
    EXPECT_NE(target_outcome(*coordinator, job).pixels, expected.pixels);
    if (restarted) {
      coordinator.reset();
      coordinator = open_denoised(dir.path());
    }
    ASSERT_TRUE(coordinator->change(job, {.target_error = targets().tight}));
    FakeFarm farm(*coordinator, 2);
    ASSERT_TRUE(farm.finish(job));
    EXPECT_EQ(target_outcome(*coordinator, job), expected) << restarted;
  }
}

TEST(DenoisedJob, ExtendingBySamplesRemovesTheTarget) {
  auto coordinator = open_denoised({});
  const JobId job = submit(*coordinator, spec_with(targets().loose));
  FakeFarm farm(*coordinator, 2);
  ASSERT_TRUE(farm.finish(job));
  ASSERT_TRUE(extend(*coordinator, job, 600));
  EXPECT_EQ(coordinator->job(job)->target_layer, TargetLayer::raw);
  ASSERT_TRUE(farm.finish(job));

  EXPECT_EQ(target_outcome(*coordinator, job).stopped, "spp");
  JobSpec plain = spec_with(1);
  plain.target_error.reset();
  plain.target_layer = TargetLayer::raw;
  plain.spp = 600;
  EXPECT_EQ(target_outcome(*coordinator, job).pixels, target_at_once(plain).pixels);
}

TEST(DenoisedJob, WaitsForAMissingDenoiserAndContinuesWithTheSamePixels) {
  TempFolder dir;
  const auto library = dir.path() / "oidn.so";
  std::filesystem::copy_file(copying(), library);
  auto coordinator = open_denoised(dir.path() / "data", library);
  const JobId job = submit(*coordinator, spec_with(targets().tight));
  std::filesystem::remove(library);
  FakeFarm farm(*coordinator, 2);

  ASSERT_TRUE(farm.work_until_paused(job));
  EXPECT_TRUE(coordinator->wait(job));
  EXPECT_THAT(coordinator->job(job)->error, HasSubstr("oidn.so"));
  EXPECT_THAT(coordinator->job(job)->error, HasSubstr("resume"));
  std::filesystem::copy_file(copying(), library);
  ASSERT_TRUE(resume(*coordinator, job));
  ASSERT_TRUE(farm.finish(job));

  EXPECT_EQ(target_outcome(*coordinator, job), target_at_once(spec_with(targets().tight)));
}

TEST(DenoisedJob, ExposedFaultyWorkerInvalidatesChecksToo) {
  const TargetOutcome expected = target_at_once(spec_with(targets().tight));
  Coordinator::Options options;
  options.denoiser = copying().string();
  options.audit_rate = 1;
  auto coordinator = Coordinator::open(std::move(options)).value();
  const JobId job = submit(*coordinator, spec_with(targets().tight));
  FakeFarm farm(*coordinator, 3);
  farm.lies = [](int worker, const UnitResult& r) { return worker == 0 && r.unit.tile == 7; };
  ASSERT_TRUE(farm.finish(job));

  EXPECT_EQ(target_outcome(*coordinator, job), expected);
}

TEST(DenoisedJob, IsRefusedWithoutADenoiserOrWithoutATarget) {
  auto without = open_denoised({}, "/no/such/libOpenImageDenoise.so.2");
  const auto refused = without->submit({"test.xml", kSceneText, {}, spec_with(targets().tight)});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().error.message, HasSubstr("deploy/install-denoiser.sh"));

  auto coordinator = open_denoised({});
  JobSpec no_target = spec_with(targets().tight);
  no_target.target_error.reset();
  const auto meant = coordinator->submit({"test.xml", kSceneText, {}, no_target});
  ASSERT_FALSE(meant);
  EXPECT_THAT(meant.error().error.message, HasSubstr("'target_layer'"));
}

}  // namespace
}  // namespace ls::coordinator
