#include "worker/cache/cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <string>

namespace ls::worker {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Serves blobs like a coordinator, in small pieces, and records the requests.
struct Source {
  std::map<Digest, std::string> blobs;
  std::vector<std::uint64_t> offsets;      // of each fetch
  std::vector<bool> complaints;            // arrived_wrong of each fetch
  std::optional<std::uint64_t> cut_after;  // the next transfer ends after this many bytes
  std::optional<std::string> lie;          // the next fetch sends this instead of the blob
  bool damaged = false;                    // every fetch sends wrong bytes
  std::function<void()> meanwhile;         // called once, before the first byte of the next fetch

  BlobRef add(const std::string& text) {
    const Digest digest = sha256(std::string_view(text));
    blobs[digest] = text;
    return {digest, text.size(), "blob"};
  }
  Result<void> fetch(const BlobRequest& wanted, const BlobSink& sink) {
    const auto& [digest, offset, arrived_wrong] = wanted;
    offsets.push_back(offset);
    complaints.push_back(arrived_wrong);
    if (const auto happens = std::exchange(meanwhile, {})) happens();
    if (!blobs.contains(digest)) return fail(Errc::not_found, "no such blob");
    std::string text = lie ? *std::exchange(lie, {}) : blobs[digest];
    if (damaged) text[0] ^= 1;
    for (std::uint64_t at = offset; at < text.size(); at += 7) {
      if (cut_after && at - offset >= *cut_after) {
        cut_after.reset();
        return fail(Errc::unavailable, "cut");
      }
      if (auto ok = sink(bytes_of(text).subspan(at, std::min<std::size_t>(7, text.size() - at))); !ok)
        return ok;
    }
    return {};
  }
};

class Cache : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "ls-cache-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::unique_ptr<BlobCache> open(std::uint64_t limit = 0) {
    auto cache = BlobCache::open(folder_, limit, [this](const BlobRequest& wanted, const BlobSink& sink) {
      return source_.fetch(wanted, sink);
    });
    return std::move(cache.value());
  }
  Source source_;
  fs::path folder_;
};

TEST_F(Cache, FetchesABlobOnceAndKeepsItOverARestart) {
  const BlobRef blob = source_.add("the steam of a bath house");

  EXPECT_EQ(content(open()->acquire(blob).value()->path()), "the steam of a bath house");
  EXPECT_EQ(content(open()->acquire(blob).value()->path()), "the steam of a bath house");

  EXPECT_EQ(source_.offsets.size(), 1U);
  EXPECT_THAT(open()->held(10), testing::ElementsAre(blob.digest));
}

TEST_F(Cache, ResumesABrokenTransfer) {
  const BlobRef blob = source_.add(std::string(100, 'x') + "y");
  source_.cut_after = 50;

  const auto cut = open()->acquire(blob);
  const auto whole = open()->acquire(blob);

  EXPECT_EQ(cut.error().code, Errc::unavailable);
  EXPECT_TRUE(whole);
  EXPECT_THAT(source_.offsets, testing::ElementsAre(0, 56));
}

TEST_F(Cache, StopInterruptsATransfer) {
  const BlobRef blob = source_.add("the steam of a bath house");
  std::atomic<bool> stop{false};
  source_.meanwhile = [&] { stop = true; };

  EXPECT_EQ(open()->acquire(blob, stop).error().code, Errc::unavailable);
  EXPECT_TRUE(open()->acquire(blob));
}

TEST_F(Cache, RefetchesDamagedTransfers) {
  const BlobRef blob = source_.add("right");
  source_.lie = "wrong";

  EXPECT_EQ(content(open()->acquire(blob).value()->path()), "right");
  EXPECT_THAT(source_.complaints, testing::ElementsAre(false, true))
      << "so that the coordinator looks at its own";
}

TEST_F(Cache, RepeatedlyDamagedTransfersAreATemporaryErrorAndDoNotFailTheJob) {
  const BlobRef blob = source_.add("right");
  source_.damaged = true;

  const auto file = open()->acquire(blob);

  EXPECT_EQ(file.error().code, Errc::internal);
  EXPECT_THAT(file.error().message, testing::HasSubstr("arrived wrong 3 times"));
}

TEST_F(Cache, StopsATransferThatIsLongerThanAnnounced) {
  const BlobRef blob = source_.add("right");
  source_.lie = std::string(1 << 20, 'z');

  const auto file = open()->acquire(blob);

  EXPECT_EQ(content(file.value()->path()), "right");
  EXPECT_TRUE(fs::is_empty(folder_ / "partial"));
}

TEST_F(Cache, FindsADamagedFileAndFetchesItAgain) {
  const BlobRef blob = source_.add("a grid");
  const fs::path path = open()->acquire(blob).value()->path();
  std::ofstream(path) << "A grid";

  EXPECT_EQ(content(open()->acquire(blob).value()->path()), "a grid");
  EXPECT_EQ(source_.offsets.size(), 2U);
}

TEST_F(Cache, EvictsTheLeastRecentlyUsedButNoFileInUse) {
  const auto cache = open(25);
  const BlobRef a = source_.add("aaaaaaaaaa"), b = source_.add("bbbbbbbbbb"), c = source_.add("cccccccccc");
  const auto in_use = cache->acquire(a).value();
  cache->acquire(b).value();

  cache->acquire(c).value();

  EXPECT_THAT(cache->held(10), testing::UnorderedElementsAre(a.digest, c.digest));
  EXPECT_EQ(content(in_use->path()), "aaaaaaaaaa");
}

TEST_F(Cache, RefusesAFileThatDoesNotFitBesideThoseInUse) {
  const auto cache = open(15);
  const auto in_use = cache->acquire(source_.add("aaaaaaaaaa")).value();

  const auto second = cache->acquire(source_.add("bbbbbbbbbb"));

  EXPECT_EQ(second.error().code, Errc::resource_exhausted);
  EXPECT_THAT(second.error().message, testing::HasSubstr("--cache-limit"));
}

TEST_F(Cache, RemovesOnlyItsOwnFiles) {
  const std::string digest = sha256(std::string_view("a thesis")).hex();
  const std::vector<fs::path> foreign = {folder_ / digest, folder_ / "kept" / digest,
                                         folder_ / "00" / "kept" / digest, folder_ / "partial" / "notes"};
  for (const fs::path& file : foreign) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << std::string(100, 'x');
  }
  const auto cache = open(15);

  EXPECT_TRUE(cache->acquire(source_.add("aaaaaaaaaa")));
  EXPECT_TRUE(cache->acquire(source_.add("bbbbbbbbbb")));

  for (const fs::path& file : foreign) EXPECT_TRUE(fs::exists(file)) << file;
  EXPECT_EQ(cache->held(10).size(), 1U);
}

TEST_F(Cache, RecreatesItsFolderAfterItIsRemovedOrEmptied) {
  const BlobRef first = source_.add("the first"), second = source_.add("the second");
  const auto cache = open();
  EXPECT_TRUE(cache->acquire(first));

  fs::remove_all(folder_);

  EXPECT_EQ(content(cache->acquire(first).value()->path()), "the first");
  EXPECT_EQ(content(cache->acquire(second).value()->path()), "the second");
  EXPECT_TRUE(fs::exists(folder_ / "CACHEDIR.TAG"));
}

TEST_F(Cache, WorksAgainOnceItsFolderCanBeWrittenAgain) {
  const BlobRef blob = source_.add("the steam");
  const auto cache = open();
  fs::remove_all(folder_);
  std::ofstream(folder_) << "a file is in the way";
  EXPECT_EQ(cache->acquire(blob).error().code, Errc::internal);

  fs::remove(folder_);

  EXPECT_EQ(content(cache->acquire(blob).value()->path()), "the steam");
}

TEST_F(Cache, MarksItsFolderForBackups) {
  open();

  EXPECT_TRUE(content(folder_ / "CACHEDIR.TAG").starts_with("Signature: 8a477f597d28d172789f06886806bc55"));
}

TEST_F(Cache, PartialTransfersCountAndAreEvictedFirst) {
  const auto cache = open(115);
  const BlobRef kept = source_.add("kept");
  cache->acquire(kept).value();
  source_.cut_after = 90;
  EXPECT_EQ(cache->acquire(source_.add(std::string(100, 'x'))).error().code, Errc::unavailable);

  EXPECT_TRUE(cache->acquire(source_.add(std::string(50, 'y'))));

  EXPECT_TRUE(fs::is_empty(folder_ / "partial"));
  EXPECT_EQ(cache->held(10).size(), 2U);
}

TEST_F(Cache, HoldsTheLimitForABlobOfUnannouncedSize) {
  const auto cache = open(105);
  BlobRef scene = source_.add(std::string(100, 's'));
  scene.bytes = 0;
  cache->acquire(source_.add("aaaaaaaaaa")).value();

  EXPECT_TRUE(cache->acquire(scene));

  EXPECT_THAT(cache->held(10), testing::ElementsAre(scene.digest));
  BlobRef larger = source_.add(std::string(200, 'l'));
  larger.bytes = 0;
  EXPECT_EQ(cache->acquire(larger).error().code, Errc::resource_exhausted);
}

TEST_F(Cache, RemovesPrivateFilesOfADeadWorker) {
  const BlobRef blob = source_.add(std::string(100, 'x'));
  open();
  const fs::path orphan = folder_ / "partial" / (blob.digest.hex() + ".Ab12Cd");
  std::ofstream(orphan) << "half";

  open();

  EXPECT_FALSE(fs::exists(orphan));
}

TEST_F(Cache, KeepsAGoodFileThatItCannotRead) {
  const BlobRef blob = source_.add("a grid");
  const fs::path path = open()->acquire(blob).value()->path();
  fs::remove(path);
  fs::create_directory(path);  // can be opened, but not read

  const auto file = open()->acquire(blob);

  EXPECT_EQ(file.error().code, Errc::internal);
  EXPECT_THAT(file.error().message, testing::HasSubstr(path.string()));
  EXPECT_TRUE(fs::exists(path));
  EXPECT_EQ(source_.offsets.size(), 1U);
}

TEST_F(Cache, SaysWhyAFetchedFileCannotBeOpened) {
  const BlobRef blob = source_.add("a grid");
  const fs::path inner = folder_ / blob.digest.hex().substr(0, 2);
  source_.meanwhile = [&] {  // makes the blob's path a link to itself, so it can never be opened
    fs::create_directory(inner);
    fs::create_symlink(blob.digest.hex(), inner / blob.digest.hex());
  };

  const auto file = open()->acquire(blob);

  EXPECT_THAT(file.error().message, testing::HasSubstr("symbolic links"));
  EXPECT_EQ(source_.offsets.size(), 1U);
}

TEST_F(Cache, KeepsTheFileInUseWhenTwoWorkersFetchTheSameAtOnce) {
  const BlobRef blob = source_.add("aaaaaaaaaa");
  const auto one = open(15), two = open(15);
  std::shared_ptr<const BlobFile> in_use;
  source_.meanwhile = [&] { in_use = one->acquire(blob).value(); };
  two->acquire(blob).value();

  EXPECT_EQ(two->acquire(source_.add("bbbbbbbbbb")).error().code, Errc::resource_exhausted);
  EXPECT_EQ(content(in_use->path()), "aaaaaaaaaa");
}

TEST_F(Cache, MissingBlobOnTheCoordinatorIsATemporaryErrorAndDoesNotFailTheJob) {
  const auto file = open()->acquire({sha256(std::string_view("?")), 1, "x"});

  EXPECT_EQ(file.error().code, Errc::internal);
  EXPECT_THAT(file.error().message, testing::HasSubstr("no such blob"));
  EXPECT_TRUE(fs::is_empty(folder_ / "partial"));
}

TEST_F(Cache, IsSharedByTwoWorkersOnOneFolder) {
  const auto one = open(15), two = open(15);
  const BlobRef a = source_.add("aaaaaaaaaa"), b = source_.add("bbbbbbbbbb");
  const auto in_use = one->acquire(a).value();

  EXPECT_EQ(two->acquire(b).error().code, Errc::resource_exhausted);
  EXPECT_TRUE(two->acquire(a));
  EXPECT_EQ(source_.offsets.size(), 1U);
}

}  // namespace
}  // namespace ls::worker
