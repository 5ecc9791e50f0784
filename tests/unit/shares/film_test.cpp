// Memory for images and the turns of submissions are shared between users.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/store/blobs/memory_blobs.h"
#include "core/image/aov/aov.h"
#include "tests/support/eventually.h"
#include "tests/unit/service/fake_farm.h"
#include "tests/unit/service/moving_store.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

// Room for four images of kSceneText at this size, two of them for one user
constexpr FrameSize kSize{1024, 1024};

class Films : public ::testing::Test {
 protected:
  tl::expected<JobId, Rejected> hand_in(const std::string& owner, const std::string& frames = "") {
    SubmitRequest request;
    request.scene_text = kSceneText;
    request.scene_name = "scene.xml";
    request.spec.size = kSize;
    request.spec.spp = 1;
    request.owner = owner;
    if (!frames.empty()) request.spec.frames = *parse_frames(frames);
    return coordinator->submit(std::move(request));
  }
  static Coordinator::Options options(const std::filesystem::path& data) {
    Coordinator::Options options;
    options.data = data;
    options.film_bytes = 4 * kSize.pixels() * film_bytes_per_pixel({}) + 1000;
    return options;
  }
  const TempFolder folder;
  std::unique_ptr<Coordinator> coordinator = std::move(*Coordinator::open(options(folder.path())));
};

TEST_F(Films, OneUserMayUseHalfOfTheFilmMemory) {
  const auto first = hand_in("mallory");
  ASSERT_TRUE(first);
  ASSERT_TRUE(hand_in("mallory"));

  const auto third = hand_in("mallory");
  ASSERT_FALSE(third);
  EXPECT_EQ(third.error().error.code, Errc::resource_exhausted);
  EXPECT_THAT(third.error().error.message, HasSubstr("user mallory"));
  EXPECT_THAT(third.error().error.message, HasSubstr("--film-memory"));
  EXPECT_TRUE(hand_in("bob"));
}

TEST_F(Films, AllUsersShareTheFilmMemory) {
  for (const char* owner : {"a", "a", "b", "b"}) ASSERT_TRUE(hand_in(owner));

  const auto more = hand_in("c");
  ASSERT_FALSE(more);
  EXPECT_THAT(more.error().error.message, HasSubstr("all jobs"));
}

TEST_F(Films, FilmsOfASequenceCountOnlyForFramesThatRenderTogether) {
  EXPECT_FALSE(hand_in("mallory", "1-100"));
  EXPECT_TRUE(hand_in("", "1-100"));  // the administrator's, which may use all of the room

  EXPECT_FALSE(hand_in("bob"));
}

TEST_F(Films, CancelledJobsFreeFilmMemory) {
  const auto first = hand_in("mallory");
  ASSERT_TRUE(hand_in("mallory"));
  ASSERT_FALSE(hand_in("mallory"));

  ASSERT_TRUE(coordinator->cancel(*first));

  EXPECT_TRUE(test::eventually([&] { return hand_in("mallory").has_value(); }));
}

// A store that does not take anything while `full` is set.
struct FullStore final : MovingStore {
  Result<void> put_jobs(std::span<const StoredJob> jobs) override {
    return full ? fail(Errc::unavailable, "cannot store a job: database is locked")
                : MovingStore::put_jobs(jobs);
  }
  Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) override {
    if (full) return fail(Errc::resource_exhausted, "the disk is full: cannot reserve ids");
    return MovingStore::reserve(counter, amount);
  }
  std::atomic<bool> full{false};
};

TEST(StoreTrouble, FailedSubmissionIsReportedUntilTheStoreAcceptsRecordsAgain) {
  const auto store = std::make_shared<FullStore>();
  const auto coordinator = std::move(*Coordinator::open({.jobs = store}));
  store->full = true;
  SubmitRequest request;
  request.scene_text = kSceneText;
  request.scene_name = "scene.xml";
  ASSERT_FALSE(coordinator->submit(request));

  std::string why;
  EXPECT_FALSE(coordinator->ready(&why));
  EXPECT_THAT(why, HasSubstr("database is locked"));
  store->full = false;
  EXPECT_TRUE(coordinator->ready(&why)) << why;
}

TEST(StoreTrouble, CoordinatorWithABrokenStoreStartsSoThatJobsCanBeRemoved) {
  const auto store = std::make_shared<FullStore>();
  JobId job;
  {
    const auto before = std::move(*Coordinator::open({.jobs = store}));
    job = submit(*before);
    ASSERT_TRUE(before->cancel(job));
  }
  store->full = true;

  auto opened = Coordinator::open({.jobs = store});

  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_TRUE((*opened)->remove(job));
}

TEST(Sequences, TooLargeSequenceIsRefusedAfterAFewFrames) {
  struct Counting final : MemoryBlobs {
    Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                        std::uint64_t length) const override {
      ++reads;
      return MemoryBlobs::read(digest, offset, length);
    }
    mutable std::atomic<int> reads{0};
  };
  const auto blobs = std::make_shared<Counting>();
  const auto coordinator = std::move(*Coordinator::open({.blobs = blobs}));
  // 47 KB of text become more as a job; of ten thousand frames that is more than 512 MB.
  std::string part = "<scene version=\"3.0.0\">";
  while (part.size() < 47'000) part += "<shape type=\"sphere\"/>";
  part += "</scene>";
  SubmitRequest request;
  request.scene_name = "scene.xml";
  request.scene_text = with_shape("<include filename=\"part.xml\"/>");
  request.assets["part.xml"] = sha256(part);
  ASSERT_TRUE(blobs->put(sha256(part), std::as_bytes(std::span(part))));
  request.spec.frames = *parse_frames("1-10000");

  const auto refused = coordinator->submit(request);

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().error.message, HasSubstr("bytes of scene text"));
  EXPECT_LE(blobs->reads, 8);  // one for each frame that was looked at
}

}  // namespace
}  // namespace ls::coordinator
