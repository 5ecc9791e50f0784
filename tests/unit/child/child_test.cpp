// The render child: this very test binary, started again with other arguments (see main below).
#include "worker/child/child.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <thread>

#include "common/image/fake_pixels.h"
#include "worker/child/serve.h"
#include "worker/fake/fake.h"

namespace ls::worker {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kMemoryLimit = 512 << 20;

LocalJob job_with_seed(std::uint64_t seed) {
  LocalJob job;
  job.brief.job = JobId{fmt::format("j-{}", seed)};
  job.brief.settings.size = {64, 64};
  job.brief.settings.integrator = "volpath";
  job.brief.settings.seed = seed;
  job.brief.settings_digest = digest_of(job.brief.settings);
  return job;
}

LeaseUnit unit(TileIndex tile) { return {tile, 0, {0, 0, 32, 32}, {0, 2}}; }

std::unique_ptr<RenderBackend> backend(const std::string& fault, int slots = 1,
                                       Duration hang_limit = std::chrono::minutes(1)) {
  ChildOptions options{.executable = std::filesystem::read_symlink("/proc/self/exe"),
                       .arguments = {"--render-child", std::to_string(slots), fault},
                       .slots = slots,
                       .hang_limit = hang_limit};
  auto made = make_child_backend(options);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

void expect_right_pixels(const tl::expected<RenderedUnit, UnitFailure>& result, std::uint64_t seed,
                         TileIndex tile) {
  ASSERT_TRUE(result) << result.error().reason;
  const JobBrief brief = job_with_seed(seed).brief;
  const LeaseUnit u = unit(tile);
  EXPECT_EQ(result->partial,
            fake_partial({brief.scene, brief.settings_digest, fake_numeric_class(), u.rect, u.samples}));
}

const std::atomic<bool> kGoOn{false};

TEST(Child, GivesTheSameBitsAsTheRendererInProcess) {
  const auto child = backend("");
  const auto direct = make_fake_backend({});
  const LocalJob job = job_with_seed(3);

  EXPECT_EQ(child->numeric_class(), fake_numeric_class());
  EXPECT_EQ(child->render(job, unit(0), kGoOn).value().partial,
            direct->render(job, unit(0), kGoOn).value().partial);
}

TEST(Child, NamesSignalPixelAndSampleOfACrash) {
  const auto child = backend("crash,tile=1");
  const LocalJob job = job_with_seed(3);

  const auto failure = child->render(job, unit(1), kGoOn).error();

  EXPECT_EQ(failure.signal, SIGSEGV);
  EXPECT_EQ(failure.pixel, std::make_pair(0, 0));
  EXPECT_EQ(failure.sample, 0U);
  EXPECT_FALSE(failure.scene_at_fault);
  EXPECT_THAT(failure.reason, HasSubstr("signal 11"));
  expect_right_pixels(child->render(job, unit(0), kGoOn), 3, 0);
}

TEST(Child, EndsAUnitThatHangs) {
  const auto child = backend("hang,tile=1", 1, std::chrono::milliseconds(200));

  const auto failure = child->render(job_with_seed(3), unit(1), kGoOn).error();

  EXPECT_THAT(failure.reason, HasSubstr("hung"));
  EXPECT_EQ(failure.pixel, std::make_pair(0, 0));
  expect_right_pixels(child->render(job_with_seed(4), unit(0), kGoOn), 4, 0);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(Child, EndsAUnitThatEatsMemory) {
  const auto child = backend("memory,tile=1");

  const auto failure = child->render(job_with_seed(3), unit(1), kGoOn).error();

  EXPECT_THAT(failure.reason, HasSubstr("memory"));
  EXPECT_EQ(failure.pixel, std::make_pair(0, 0));
  expect_right_pixels(child->render(job_with_seed(3), unit(0), kGoOn), 3, 0);
}
#endif

TEST(Child, RendersInnocentUnitsAgainAfterACrashOfAnother) {
  const auto child = backend("crash,tile=1", 2);
  const LocalJob job = job_with_seed(5);
  std::jthread guilty([&] {
    for (int i = 0; i < 10; ++i) EXPECT_FALSE(child->render(job, unit(1), kGoOn));
  });

  for (int i = 0; i < 200; ++i) expect_right_pixels(child->render(job, unit(2), kGoOn), 5, 2);
}

TEST(Child, StopsAUnitWhenTold) {
  const auto child = backend("hang,tile=1");
  std::atomic<bool> stop{false};
  std::jthread teller([&] { stop = true; });

  EXPECT_FALSE(child->render(job_with_seed(3), unit(1), stop));
}

TEST(Child, ComesBackAtOnceWhenShutDown) {
  const auto child = backend("hang");
  std::jthread ender([&] { child->shutdown(); });

  EXPECT_FALSE(child->render(job_with_seed(3), unit(1), kGoOn));
}

TEST(Child, SaysWhyItCannotStart) {
  const auto made = make_child_backend({.executable = "/nonexistent/worker"});

  EXPECT_THAT(made.error().message, HasSubstr("/nonexistent/worker"));
}

}  // namespace
}  // namespace ls::worker

int main(int argc, char** argv) {
  if (argc == 4 && std::strcmp(argv[1], "--render-child") == 0) {
    ls::worker::child::confine(ls::worker::kMemoryLimit);
    ls::worker::FakeOptions options;
    options.fault = ls::worker::parse_fake_fault(argv[3]).value();
    const auto backend = ls::worker::make_fake_backend(options);
    return ls::worker::child::serve(*backend, std::stoi(argv[2]));
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
