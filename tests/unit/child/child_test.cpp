// Tests of the backend with a render child. The child is this test program, started with other arguments (see
// main below).
#include "worker/child/child.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>
#include <vector>

#include "util/protocol/limits.h"
#include "worker/child/protocol.h"
#include "worker/child/serve.h"
#include "worker/fake/fake.h"
#include "worker/fake/fake_pixels.h"

namespace ls::worker {
namespace {

using testing::AnyOf;
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

TEST(Child, ReportsTheHealthOfAUnit) {
  const auto child = backend("unwell,tile=1");
  const LocalJob job = job_with_seed(3);

  const auto well = child->render(job, unit(0), kGoOn), unhealthy = child->render(job, unit(1), kGoOn);

  EXPECT_TRUE(well.value().health.clean());
  Health expected;
  expected.add(HealthCause::infinite, 2, {0, 0, 0});
  EXPECT_EQ(unhealthy.value().health, expected);
  EXPECT_EQ(unhealthy.value().partial.sums, well.value().partial.sums);
}

TEST(Child, ReportsSignalPixelAndSampleOfACrash) {
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

TEST(Child, UnitThatHangsFails) {
  const auto child = backend("hang,tile=1", 1, std::chrono::milliseconds(200));

  const auto failure = child->render(job_with_seed(3), unit(1), kGoOn).error();

  EXPECT_THAT(failure.reason, HasSubstr("hung"));
  EXPECT_EQ(failure.pixel, std::make_pair(0, 0));
  expect_right_pixels(child->render(job_with_seed(4), unit(0), kGoOn), 4, 0);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(Child, UnitThatExceedsMemoryFails) {
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

TEST(Child, StopsAUnitOnRequest) {
  const auto child = backend("hang,tile=1");
  std::atomic<bool> stop{false};
  std::jthread teller([&] { stop = true; });

  EXPECT_FALSE(child->render(job_with_seed(3), unit(1), stop));
}

TEST(Child, ShutdownReturnsAtOnce) {
  const auto child = backend("hang");
  std::jthread ender([&] { child->shutdown(); });

  EXPECT_FALSE(child->render(job_with_seed(3), unit(1), kGoOn));
}

TEST(Child, ReportsWhyItCannotStart) {
  const auto made = make_child_backend({.executable = "/nonexistent/worker"});

  EXPECT_THAT(made.error().message, HasSubstr("/nonexistent/worker"));
}

TEST(Child, KillsARendererThatClosesItsEndButKeepsRunning) {
  const auto child = backend("odd,closes");

  EXPECT_FALSE(child->render(job_with_seed(3), unit(0), kGoOn));
}

// The child answers nonsense on slot 0 as soon as it has been asked for a unit on both of its slots.
TEST(Child, InvalidAnswerFailsTheUnitOfItsSlot) {
  const auto child = backend("odd,nonsense", 2);
  std::atomic<bool> stop{false};
  std::array<std::string, 2> reasons;
  {
    std::array<std::jthread, 2> threads;
    for (std::size_t i = 0; i < 2; ++i)
      threads[i] = std::jthread([&, i] {
        const auto result = child->render(job_with_seed(3), unit(static_cast<TileIndex>(i)), stop);
        if (!result) reasons[i] = result.error().reason;
        stop = true;  // the other unit is innocent, and would be rendered again for ever
      });
  }

  EXPECT_EQ(std::ranges::count(reasons, "the renderer answered nonsense"), 1) << reasons[0] << reasons[1];
}

TEST(Child, ClosedChannelFailsTheUnitOfItsSlot) {
  const auto child = backend("odd,closes", 2);
  std::atomic<bool> stop{false};
  std::array<std::string, 2> reasons;
  {
    std::array<std::jthread, 2> threads;
    for (std::size_t i = 0; i < 2; ++i)
      threads[i] = std::jthread([&, i] {
        const auto result = child->render(job_with_seed(3), unit(static_cast<TileIndex>(i)), stop);
        if (!result) reasons[i] = result.error().reason;
        stop = true;
      });
  }

  EXPECT_EQ(std::ranges::count(reasons, "the renderer closed its channel without an answer"), 1)
      << reasons[0] << reasons[1];
}

TEST(Child, CannotShrinkTheSharedMemory) {
  const auto child = backend("odd,cuts");

  EXPECT_THAT(child->render(job_with_seed(3), unit(0), kGoOn).error().reason,
              HasSubstr("Operation not permitted"));
}

TEST(Child, HasItsOwnSessionAndWritesToAPipe) {
  const auto child = backend("odd,tells");

  const std::string told = child->render(job_with_seed(3), unit(0), kGoOn).error().reason;

  EXPECT_THAT(told, HasSubstr("own session"));
  EXPECT_THAT(told, HasSubstr("1 pipe:"));
  EXPECT_THAT(told, HasSubstr("2 pipe:"));
}

TEST(Child, LeavesNoProcessBehind) {
  std::string descendant;
  {
    const auto child = backend("odd,forks");
    descendant = child->render(job_with_seed(3), unit(0), kGoOn).error().reason;
    child->shutdown();
  }

  // It is killed, and is a zombie until its new parent collects it.
  std::string state;
  do {
    std::string word;
    state.clear();
    std::ifstream("/proc/" + descendant + "/stat") >> word >> word >> state;
  } while (state == "R" || state == "S");
  EXPECT_THAT(state, AnyOf("", "Z", "X"));
}

TEST(Child, ReasonsHaveNoControlCharacters) {
  const auto child = backend("odd,forges");

  EXPECT_EQ(child->render(job_with_seed(3), unit(0), kGoOn).error().reason,
            "bad  [31m 2026 info all is well");
}

TEST(Child, ReportsNoPixelOutsideTheImage) {
  const auto child = backend("odd,beside");

  EXPECT_FALSE(child->render(job_with_seed(3), unit(0), kGoOn).error().pixel);
}

// The agent believes no measurement that is longer than the time that it waited.
TEST(Child, ReportsNoMoreTimeThanPassed) {
  const auto child = backend("odd,slow");

  const auto rendered = child->render(job_with_seed(3), unit(0), kGoOn);

  ASSERT_TRUE(rendered) << rendered.error().reason;
  EXPECT_LT(rendered->cpu_seconds, 86399);
  EXPECT_EQ(rendered->wall_seconds, 0);  // it said NaN
}

TEST(Child, AbandonsAWorldOnRequest) {
  const auto child = backend("odd,obeys");
  std::atomic<bool> stop{true};

  EXPECT_EQ(child->prepare(job_with_seed(4), stop).error().reason, "told to stop");

  expect_right_pixels(child->render(job_with_seed(3), unit(0), kGoOn), 3, 0);
}

// A child that builds on is killed, so that the next world can be built.
TEST(Child, IsKilledIfItIgnoresAStopWhileBuilding) {
  const auto child = backend("odd,builds");
  std::atomic<bool> stop{true};

  EXPECT_EQ(child->prepare(job_with_seed(4), stop).error().reason, "told to stop");

  expect_right_pixels(child->render(job_with_seed(3), unit(0), kGoOn), 3, 0);
}

TEST(Child, KillsARendererThatStopsDuringAnAnswer) {
  const auto child = backend("odd,half", 1, std::chrono::milliseconds(200));

  EXPECT_THAT(child->render(job_with_seed(3), unit(0), kGoOn).error().reason, HasSubstr("hung"));
}

TEST(Child, ReplacesARendererThatHangsWhenItFreesAScene) {
  const auto child = backend("odd,forget", 1, std::chrono::milliseconds(200));
  ASSERT_TRUE(child->prepare(job_with_seed(3), kGoOn));
  child->forget(job_with_seed(3).brief.job);

  EXPECT_TRUE(child->prepare(job_with_seed(4), kGoOn));
}

// A coordinator whose data were replaced assigns a job's id to another job while a unit of the old one is
// being rendered.
TEST(Child, RendersTheNewerOfTwoJobsWithOneIdAfterAUnitOfTheOlderOne) {
  const auto child = backend("");
  const LocalJob old = job_with_seed(3);
  LocalJob other = job_with_seed(4);
  other.brief.job = old.brief.job;
  ASSERT_TRUE(child->prepare(old, kGoOn));
  child->forget(old.brief.job);
  expect_right_pixels(child->render(old, unit(0), kGoOn), 3, 0);

  ASSERT_TRUE(child->prepare(other, kGoOn));

  expect_right_pixels(child->render(other, unit(0), kGoOn), 4, 0);
}

// A scene that takes too long to build does not affect other jobs: those that are ready are rendered
// meanwhile and afterwards.
TEST(Child, RendersOtherJobsDuringAnEndlessBuild) {
  ChildOptions options{.arguments = {"--render-child", "1", "odd,builds"},
                       .prepare_limit = std::chrono::milliseconds(500)};
  const auto child = make_child_backend(options).value();
  ASSERT_TRUE(child->prepare(job_with_seed(3), kGoOn));
  std::jthread builder([&] {
    EXPECT_THAT(child->prepare(job_with_seed(4), kGoOn).error().reason,
                HasSubstr("building the scene took longer than"));
  });

  for (int i = 0; i < 20; ++i) expect_right_pixels(child->render(job_with_seed(3), unit(0), kGoOn), 3, 0);
  builder.join();
  expect_right_pixels(child->render(job_with_seed(3), unit(0), kGoOn), 3, 0);
}

TEST(Child, AcceptsAsManyFilesAsAJobMayHave) {
  const auto child = backend("");
  LocalJob job = job_with_seed(3);
  for (std::size_t i = 0; i < limits::kAssetsPerJob; ++i) {
    const Digest digest = sha256(std::to_string(i));
    job.brief.assets.push_back({digest, 1, std::string(limits::kNameBytes, 'n')});
    job.assets[digest] = std::filesystem::path("/") / std::string(200, 'd') / digest.hex();
  }

  expect_right_pixels(child->render(job, unit(0), kGoOn), 3, 0);
}

TEST(Child, EnvironmentHasNoSecretsOfTheAgent) {
  ::setenv("LIGHTSHAFT_TEST_CLOUD_KEY", "secret", 1);
  const auto made = make_child_backend({.arguments = {"--render-child", "1", "odd,environment"}});
  ::unsetenv("LIGHTSHAFT_TEST_CLOUD_KEY");

  EXPECT_TRUE(made) << made.error().message;
}

TEST(Child, ReportsTooFewFileDescriptors) {
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

TEST_F(ChildOfAFile, BreaksIfANewChildHasAnotherNumericClass) {
  const auto child = backend("class," + file_.string());
  EXPECT_FALSE(child->render(job_with_seed(3), unit(1), kGoOn));  // it crashes
  EXPECT_FALSE(child->broken());
  std::ofstream(file_) << "two";

  EXPECT_FALSE(child->render(job_with_seed(3), unit(0), kGoOn));

  ASSERT_TRUE(child->broken());
  EXPECT_THAT(child->broken()->message, AllOf(HasSubstr("replaced"), HasSubstr("child_test")));
}

TEST_F(ChildOfAFile, BreaksIfNewChildrenRepeatedlyEndBeforeTheyAreReady) {
  const auto child = backend("class," + file_.string());
  EXPECT_FALSE(child->render(job_with_seed(3), unit(1), kGoOn));  // it crashes
  std::filesystem::remove(file_);

  EXPECT_FALSE(child->render(job_with_seed(3), unit(0), kGoOn));

  ASSERT_TRUE(child->broken());
  EXPECT_THAT(child->broken()->message, HasSubstr("ended with exit code 3 before it was ready"));
}

// The new child fails as if there were not enough address space for a moment.
TEST_F(ChildOfAFile, ReplacesANewChildThatEndsBeforeItIsReady) {
  const auto child = backend("later," + file_.string());
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(child->render(job_with_seed(3), unit(1), kGoOn));  // it crashes
    std::filesystem::remove(file_);

    EXPECT_TRUE(child->render(job_with_seed(3), unit(0), kGoOn));
  }
  EXPECT_FALSE(child->broken());
}

// A fake renderer that never finishes building the world of the job with seed 4, unless it is told to stop
// and obeys.
class Builder final : public LocalBackend {
 public:
  explicit Builder(bool obeys) : obeys_(obeys) {}
  Digest numeric_class() const override { return fake_->numeric_class(); }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job, const std::atomic<bool>& stop) override {
    while (job.brief.settings.seed == 4 && !(obeys_ && stop)) std::this_thread::yield();
    if (job.brief.settings.seed == 4) return unit_failure("stopped");
    return fake_->prepare(job, stop);
  }
  tl::expected<RenderedUnit, UnitFailure> render_marked(const LocalJob& job, const LeaseUnit& unit,
                                                        const std::atomic<bool>& stop,
                                                        render::Breadcrumb* where) override {
    return fake_->render_marked(job, unit, stop, where);
  }
  void forget(const JobId& job) override { fake_->forget(job); }
  std::uint64_t rss_bytes() const override { return 0; }

 private:
  const bool obeys_;
  const std::unique_ptr<LocalBackend> fake_ = make_fake_backend({});
};

std::string link_of(int fd) {
  std::error_code none;
  return std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(fd), none).string();
}

// Answers the request of slot 0 as told.
void answer_oddly(const std::string& kind, child::Slot& slot) {
  using namespace child;
  Reply reply{.outcome = Outcome::failed};
  std::string text;
  if (kind == "cuts") text = ::ftruncate(kSharedMemoryFd, 0) == 0 ? "cut" : std::strerror(errno);
  if (kind == "tells")
    text = std::string(::getsid(0) == ::getpid() ? "own session" : "session of another") + " 1 " +
           link_of(1) + " 2 " + link_of(2);
  if (kind == "forks") {
    const pid_t descendant = ::fork();
    if (descendant == 0)
      for (;;) ::pause();
    text = std::to_string(descendant);
  }
  if (kind == "forges") text = "bad\n\x1b[31m\n2026 info all is well";
  if (kind == "beside") slot.where.x = 1 << 20, slot.where.y = 0;
  if (kind == "slow") reply = {.cpu_seconds = 86399, .wall_seconds = std::nan("")};
  reply.text_bytes = static_cast<std::uint32_t>(text.size());
  if (kind == "nonsense") reply.text_bytes = kReasonBytes + 1;
  if (kind == "closes") ::close(kFirstSlotFd);
  if (kind == "closes") return;
  send_all(kFirstSlotFd, &reply, kind == "half" ? sizeof reply / 2 : sizeof reply);
  send_all(kFirstSlotFd, text.data(), text.size());
}

// Children that behave as no renderer would: they answer half a reply, close a channel, or never answer.
int serve_oddly(const std::string& kind, int slots) {
  using namespace child;
  if (kind == "builds" || kind == "obeys") {
    Builder builder(kind == "obeys");
    return serve(builder, 1);
  }
  if (kind == "environment") {
    std::ifstream own("/proc/self/environ");
    const std::string all{std::istreambuf_iterator<char>(own), {}};
    return all.find("secret") == std::string::npos ? serve(*make_fake_backend({}), 1) : 9;
  }
  auto* const shared = static_cast<Shared*>(
      ::mmap(nullptr, Shared::bytes(slots), PROT_READ | PROT_WRITE, MAP_SHARED, kSharedMemoryFd, 0));
  // Slot 0 answers once all slots have been asked. Any slot answers properly when it is told to stop.
  std::atomic<int> asked{0};
  std::vector<std::jthread> threads;
  for (int i = 0; i < slots && kind != "forget"; ++i)
    threads.emplace_back([&, i] {
      Request of_slot;
      if (!receive_all(kFirstSlotFd + i, &of_slot, sizeof of_slot)) return;
      ++asked;
      Slot& slot = shared->slots()[i];
      while ((i > 0 || asked < slots) && !slot.stop) std::this_thread::yield();
      const Reply stopped{.outcome = Outcome::stopped};
      slot.stop ? static_cast<void>(send_all(kFirstSlotFd + i, &stopped, sizeof stopped))
                : answer_oddly(kind, slot);
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
  if (how.starts_with("odd,")) return serve_oddly(how.substr(4), slots);
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
