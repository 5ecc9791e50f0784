// Tests of the backend with a render child. The child is this test program, started with other arguments (see
// main below).
#include "worker/child/child.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>

#include "common/protocol/limits.h"
#include "worker/child/protocol.h"
#include "worker/child/serve.h"
#include "worker/fake/fake.h"
#include "worker/fake/fake_pixels.h"

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
  ChildOptions options{.arguments = {"--render-child", std::to_string(slots), fault},
                       .slots = slots,
                       .hang_limit = hang_limit,
                       .forget_limit = hang_limit,
                       .respawn_pause = std::chrono::milliseconds(1)};
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

TEST(Child, TellsOfTheHealthOfAUnit) {
  const auto child = backend("unwell,tile=1");
  const LocalJob job = job_with_seed(3);

  const auto well = child->render(job, unit(0), kGoOn), unhealthy = child->render(job, unit(1), kGoOn);

  EXPECT_TRUE(well.value().health.clean());
  Health expected;
  expected.add(HealthCause::infinite, 2, {0, 0, 0});
  EXPECT_EQ(unhealthy.value().health, expected);
  EXPECT_EQ(unhealthy.value().partial.sums, well.value().partial.sums);
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

TEST(Child, KillsARendererThatClosesItsEndAndLivesOn) {
  const auto child = backend("odd,closes");

  EXPECT_FALSE(child->render(job_with_seed(3), unit(0), kGoOn));
}

TEST(Child, EndsARendererThatStopsInTheMiddleOfAnAnswer) {
  const auto child = backend("odd,half", 1, std::chrono::milliseconds(200));

  EXPECT_THAT(child->render(job_with_seed(3), unit(0), kGoOn).error().reason, HasSubstr("hung"));
}

TEST(Child, ReplacesARendererThatHangsWhenItFreesAScene) {
  const auto child = backend("odd,forget", 1, std::chrono::milliseconds(200));
  ASSERT_TRUE(child->prepare(job_with_seed(3)));
  child->forget(job_with_seed(3).brief.job);

  EXPECT_TRUE(child->prepare(job_with_seed(4)));
}

// A coordinator whose data were replaced assigns a job's id to another job while a unit of the old one is
// being rendered.
TEST(Child, RendersTheNewOfTwoJobsOfOneIdAfterAUnitOfTheOldOneCameBetween) {
  const auto child = backend("");
  const LocalJob old = job_with_seed(3);
  LocalJob other = job_with_seed(4);
  other.brief.job = old.brief.job;
  ASSERT_TRUE(child->prepare(old));
  child->forget(old.brief.job);
  expect_right_pixels(child->render(old, unit(0), kGoOn), 3, 0);

  ASSERT_TRUE(child->prepare(other));

  expect_right_pixels(child->render(other, unit(0), kGoOn), 4, 0);
}

// A scene that takes too long to build does not affect other jobs: those that are ready are rendered
// meanwhile and afterwards.
TEST(Child, RendersOtherJobsWhileAWorldIsBuiltWithoutEnd) {
  ChildOptions options{.arguments = {"--render-child", "1", "odd,builds"},
                       .prepare_limit = std::chrono::milliseconds(500)};
  const auto child = make_child_backend(options).value();
  ASSERT_TRUE(child->prepare(job_with_seed(3)));
  std::jthread builder([&] {
    EXPECT_THAT(child->prepare(job_with_seed(4)).error().reason,
                HasSubstr("building the scene took longer than"));
  });

  for (int i = 0; i < 20; ++i) expect_right_pixels(child->render(job_with_seed(3), unit(0), kGoOn), 3, 0);
  builder.join();
  expect_right_pixels(child->render(job_with_seed(3), unit(0), kGoOn), 3, 0);
}

TEST(Child, IsToldOfAsManyFilesAsAJobMayHave) {
  const auto child = backend("");
  LocalJob job = job_with_seed(3);
  for (std::size_t i = 0; i < limits::kAssetsPerJob; ++i) {
    const Digest digest = sha256(std::to_string(i));
    job.brief.assets.push_back({digest, 1, std::string(limits::kNameBytes, 'n')});
    job.assets[digest] = std::filesystem::path("/") / std::string(200, 'd') / digest.hex();
  }

  expect_right_pixels(child->render(job, unit(0), kGoOn), 3, 0);
}

TEST(Child, SeesNoSecretsOfTheAgentsEnvironment) {
  ::setenv("LIGHTSHAFT_TEST_CLOUD_KEY", "secret", 1);
  const auto made = make_child_backend({.arguments = {"--render-child", "1", "odd,environment"}});
  ::unsetenv("LIGHTSHAFT_TEST_CLOUD_KEY");

  EXPECT_TRUE(made) << made.error().message;
}

TEST(Child, SaysThatThereAreTooFewFileDescriptors) {
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const int lowest_free = ::dup(0);
  ::close(lowest_free);
  const rlimit few{static_cast<rlim_t>(lowest_free) + 1, before.rlim_max};
  ::setrlimit(RLIMIT_NOFILE, &few);
  const auto made = make_child_backend({.arguments = {"--render-child", "1", ""}});
  ::setrlimit(RLIMIT_NOFILE, &before);

  EXPECT_THAT(made.error().message, HasSubstr("ulimit -n"));
}

// The child's numeric class is the SHA-256 of the content of `file_`.
class ChildOfAFile : public testing::Test {
 protected:
  ChildOfAFile() { std::ofstream(file_) << "one"; }
  ~ChildOfAFile() override { std::filesystem::remove(file_); }
  const std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / fmt::format("ls-child-{}", ::getpid());
};

TEST_F(ChildOfAFile, IsBrokenWhenANewChildHasAnotherNumericClass) {
  const auto child = backend("class," + file_.string());
  EXPECT_FALSE(child->render(job_with_seed(3), unit(1), kGoOn));  // it crashes
  EXPECT_FALSE(child->broken());
  std::ofstream(file_) << "two";

  EXPECT_FALSE(child->render(job_with_seed(3), unit(0), kGoOn));

  ASSERT_TRUE(child->broken());
  EXPECT_THAT(child->broken()->message, AllOf(HasSubstr("replaced"), HasSubstr("child_test")));
}

TEST_F(ChildOfAFile, IsBrokenWhenNewChildrenEndBeforeTheyAreReadyAgainAndAgain) {
  const auto child = backend("class," + file_.string());
  EXPECT_FALSE(child->render(job_with_seed(3), unit(1), kGoOn));  // it crashes
  std::filesystem::remove(file_);

  EXPECT_FALSE(child->render(job_with_seed(3), unit(0), kGoOn));

  ASSERT_TRUE(child->broken());
  EXPECT_THAT(child->broken()->message, HasSubstr("ended with exit code 3 before it was ready"));
}

// The new child fails as if there were not enough address space for a moment.
TEST_F(ChildOfAFile, StartsAnotherAfterANewChildThatEndsBeforeItIsReady) {
  const auto child = backend("later," + file_.string());
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(child->render(job_with_seed(3), unit(1), kGoOn));  // it crashes
    std::filesystem::remove(file_);

    EXPECT_TRUE(child->render(job_with_seed(3), unit(0), kGoOn));
  }
  EXPECT_FALSE(child->broken());
}

// A fake renderer that never finishes building the world of the job with seed 4.
class Builder final : public LocalBackend {
 public:
  Digest numeric_class() const override { return fake_->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job) override {
    while (job.brief.settings.seed == 4) ::pause();
    return fake_->prepare(job);
  }
  tl::expected<RenderedUnit, UnitFailure> render_marked(const LocalJob& job, const LeaseUnit& unit,
                                                        const std::atomic<bool>& stop,
                                                        render::Breadcrumb* where) override {
    return fake_->render_marked(job, unit, stop, where);
  }
  void forget(const JobId& job) override { fake_->forget(job); }
  std::uint64_t rss_bytes() const override { return 0; }

 private:
  const std::unique_ptr<LocalBackend> fake_ = make_fake_backend({});
};

// Children that behave as no renderer would: they answer half a reply, close a channel, or never answer.
int serve_oddly(const std::string& kind) {
  using namespace child;
  if (kind == "builds") {
    Builder builder;
    return serve(builder, 1);
  }
  if (kind == "environment") {
    std::ifstream own("/proc/self/environ");
    const std::string all{std::istreambuf_iterator<char>(own), {}};
    return all.find("secret") == std::string::npos ? serve(*make_fake_backend({}), 1) : 9;
  }
  std::jthread slot([&kind] {
    Request request;
    if (!receive_all(kFirstSlotFd, &request, sizeof request)) return;
    const Reply reply;
    if (kind == "half") send_all(kFirstSlotFd, &reply, sizeof reply / 2);
    if (kind == "closes") ::close(kFirstSlotFd);
  });
  Request request;
  while (receive_all(kControlFd, &request, sizeof request)) {
    std::string text(request.text_bytes, 0);
    receive_all(kControlFd, text.data(), text.size());
    if (request.kind == Kind::forget) break;
    const Reply reply{.numeric_class = fake_numeric_class()};
    send_all(kControlFd, &reply, sizeof reply);
  }
  for (;;) ::pause();
}

int serve_as_told(int slots, const std::string& how) {
  if (how.starts_with("odd,")) return serve_oddly(how.substr(4));
  FakeOptions options;
  // A child that finds no file creates it and ends; the next one serves.
  const bool later = how.starts_with("later,");
  if (later || how.starts_with("class,")) {
    std::ifstream in(how.substr(6));
    std::string text;
    const bool there = static_cast<bool>(in >> text);
    if (!there && later) std::ofstream(how.substr(6)) << "one";
    if (!there) return 3;
    options.numeric_class = sha256(text);
    options.fault = parse_fake_fault("crash,tile=1").value();
  } else {
    options.fault = parse_fake_fault(how).value();
  }
  return child::serve(*make_fake_backend(options), slots);
}

}  // namespace
}  // namespace ls::worker

int main(int argc, char** argv) {
  if (argc == 4 && std::strcmp(argv[1], "--render-child") == 0) {
    ls::worker::child::confine(ls::worker::kMemoryLimit);
    return ls::worker::serve_as_told(std::stoi(argv[2]), argv[3]);
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
