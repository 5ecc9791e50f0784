#include "coordinator/store/log/partial_log.h"

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>

#include "coordinator/base/limits.h"
#include "tests/unit/store/temp_folder.h"

namespace {
off_t unreadable_from = -1;  // reads from this offset on fail in every file; -1: none fails
}
// Replaces the C library's function in this program.
extern "C" ssize_t pread(int file, void* bytes, std::size_t count, off_t at) {
  if (unreadable_from >= 0 && at >= unreadable_from) {
    errno = EIO;
    return -1;
  }
  return ::syscall(SYS_pread64, file, bytes, count, at);
}

namespace ls::coordinator {
namespace {

PartialRecord record(std::uint32_t n) {
  PartialRecord r;
  r.tile = n;
  r.round = n % 5;
  r.samples = {n, n + 2};
  r.digest = sha256(std::to_string(n));
  r.worker.value = "w-" + std::to_string(n);
  r.cpu_seconds = n * .5;
  r.at_seconds = n;
  return r;
}
std::vector<std::byte> payload(std::uint32_t n, std::size_t size = 700) {
  return std::vector<std::byte>(size, static_cast<std::byte>(n));
}
constexpr std::uint64_t kRecordBytes = 184 + 700;

void fill(const std::filesystem::path& dir, std::uint32_t count) {
  auto log = PartialLog::open(dir).value();
  for (std::uint32_t i = 0; i < count; ++i) ASSERT_TRUE(log->append(record(i), payload(i)));
  ASSERT_TRUE(log->sync());
}

TEST(PartialLog, MakesNoFileBeforeTheFirstRecord) {
  TempFolder dir;
  const auto folder = dir.path() / "job";
  const auto log = PartialLog::open(folder).value();
  ASSERT_TRUE(log->sync());
  EXPECT_FALSE(std::filesystem::exists(folder));

  ASSERT_TRUE(log->append(record(1), payload(1)));
  ASSERT_TRUE(log->sync());

  EXPECT_EQ(PartialLog::open(folder).value()->found().size(), 1u);
}

PartialRecord unhealthy(std::uint32_t n) {
  PartialRecord r = record(n);
  r.health.add(HealthCause::infinite, 2, {static_cast<int>(n), 1, 3});
  r.health.add(HealthCause::negative_density, 7);
  return r;
}

TEST(PartialLog, KeepsTheHealthOfARecord) {
  TempFolder dir;
  {
    auto log = PartialLog::open(dir.path()).value();
    for (std::uint32_t i = 0; i < 6; ++i)
      ASSERT_TRUE(log->append(i % 2 ? unhealthy(i) : record(i), payload(i)));
    ASSERT_TRUE(log->sync());
  }
  const auto log = PartialLog::open(dir.path()).value();
  ASSERT_EQ(log->found().size(), 6u);
  for (std::uint32_t i = 0; i < 6; ++i) {
    EXPECT_EQ(log->found()[i].record, i % 2 ? unhealthy(i) : record(i));
    EXPECT_EQ(log->read(log->found()[i].place).value(), payload(i));
  }
}

// A record ends with the text of its health. If this text is cut off or changed, the record is damaged.
TEST(PartialLog, CutsARecordWhoseHealthIsTornOrDamaged) {
  for (const bool torn : {true, false}) {
    TempFolder dir;
    {
      auto log = PartialLog::open(dir.path()).value();
      ASSERT_TRUE(log->append(record(0), payload(0)));
      ASSERT_TRUE(log->append(unhealthy(1), payload(1)));
      ASSERT_TRUE(log->sync());
    }
    const auto file = dir.path() / "partials-000.seg";
    const auto size = std::filesystem::file_size(file);
    if (torn) {
      std::filesystem::resize_file(file, size - 1);
    } else {
      std::fstream damaged(file, std::ios::binary | std::ios::in | std::ios::out);
      damaged.seekp(static_cast<std::streamoff>(size - 10));
      damaged.put('9');
    }
    const auto log = PartialLog::open(dir.path()).value();
    ASSERT_EQ(log->found().size(), 1u) << torn;
    EXPECT_EQ(std::filesystem::file_size(file), kRecordBytes);
  }
}

TEST(PartialLog, FindsEveryRecordAfterReopening) {
  TempFolder dir;
  fill(dir.path(), 10);

  const auto log = PartialLog::open(dir.path()).value();

  ASSERT_EQ(log->found().size(), 10u);
  EXPECT_EQ(std::filesystem::file_size(dir.path() / "partials-000.seg"), 10 * kRecordBytes);
  for (std::uint32_t i = 0; i < 10; ++i) {
    EXPECT_EQ(log->found()[i].record, record(i));
    EXPECT_EQ(log->read(log->found()[i].place).value(), payload(i));
  }
}

TEST(PartialLog, CutsATornTailAtAnyByteAndContinues) {
  for (std::uint64_t torn = 1; torn <= kRecordBytes; torn += 61) {
    TempFolder dir;
    fill(dir.path(), 3);
    const auto file = dir.path() / "partials-000.seg";
    std::filesystem::resize_file(file, 3 * kRecordBytes - torn);

    auto log = PartialLog::open(dir.path()).value();
    ASSERT_EQ(log->found().size(), 2u) << torn;
    EXPECT_EQ(std::filesystem::file_size(file), 2 * kRecordBytes);
    ASSERT_TRUE(log->append(record(7), payload(7)));

    const auto again = PartialLog::open(dir.path()).value();
    ASSERT_EQ(again->found().size(), 3u);
    EXPECT_EQ(again->found()[2].record, record(7));
  }
}

TEST(PartialLog, CutsARecordWhosePayloadOrHeaderIsDamaged) {
  for (const std::uint64_t place : {kRecordBytes + 20, kRecordBytes + 400}) {
    TempFolder dir;
    fill(dir.path(), 2);
    {
      std::fstream file(dir.path() / "partials-000.seg", std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(static_cast<std::streamoff>(place));
      file.put('!');
    }
    EXPECT_EQ(PartialLog::open(dir.path()).value()->found().size(), 1u);
  }
}

TEST(PartialLog, KeepsRecordsThatTheDiskTemporarilyCannotRead) {
  TempFolder dir;
  fill(dir.path(), 3);
  {
    unreadable_from = kRecordBytes;
    auto log = PartialLog::open(dir.path()).value();
    unreadable_from = -1;
    EXPECT_EQ(log->found().size(), 1u);
    EXPECT_EQ(std::filesystem::file_size(dir.path() / "partials-000.seg"), 3 * kRecordBytes);
    ASSERT_TRUE(log->append(record(7), payload(7)));
    ASSERT_TRUE(log->sync());
  }

  const auto log = PartialLog::open(dir.path()).value();

  std::vector<PartialRecord> records;
  for (const auto& entry : log->found()) records.push_back(entry.record);
  EXPECT_EQ(records, (std::vector{record(0), record(1), record(2), record(7)}));
}

TEST(PartialLog, VerifiesTheBytesOfASegmentWithoutAnIndex) {
  TempFolder dir;
  fill(dir.path(), 2);
  std::filesystem::copy(dir.path() / "partials-000.seg", dir.path() / "partials-001.seg");
  {
    std::fstream file(dir.path() / "partials-000.seg", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(kRecordBytes + 400);
    file.put('!');
  }
  EXPECT_EQ(PartialLog::open(dir.path()).value()->found().size(), 3u);
}

TEST(PartialLog, DetectsDamageWhenAPartialIsRead) {
  TempFolder dir;
  auto log = PartialLog::open(dir.path()).value();
  const auto place = log->append(record(1), payload(1)).value();
  {
    std::fstream file(dir.path() / "partials-000.seg", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(300);
    file.put('!');
  }
  EXPECT_EQ(log->read(place).error().code, Errc::unavailable);
}

TEST(PartialLog, LeavesASegmentThatCannotBeSynced) {
  TempFolder dir;
  // /dev/null accepts all writes but cannot be synced.
  std::filesystem::create_symlink("/dev/null", dir.path() / "partials-000.seg");
  auto log = PartialLog::open(dir.path()).value();
  ASSERT_TRUE(log->append(record(1), payload(1)));
  EXPECT_FALSE(log->sync());

  const auto place = log->append(record(1), payload(1));

  ASSERT_TRUE(place);
  EXPECT_EQ(place->segment, 1u);
  ASSERT_TRUE(log->sync());
  EXPECT_EQ(log->read(*place).value(), payload(1));
}

TEST(PartialLog, StartsANewSegmentWhenOneIsFull) {
  TempFolder dir;
  const std::size_t big = std::size_t{900} << 10;
  const auto count = static_cast<std::uint32_t>(limits::kMaxSegmentBytes / big + 3);
  {
    auto log = PartialLog::open(dir.path()).value();
    for (std::uint32_t i = 0; i < count; ++i) ASSERT_TRUE(log->append(record(i), payload(i, big)));
  }
  EXPECT_TRUE(std::filesystem::exists(dir.path() / "partials-001.seg"));
  const auto log = PartialLog::open(dir.path()).value();
  ASSERT_EQ(log->found().size(), count);
  EXPECT_EQ(log->read(log->found().back().place).value(), payload(count - 1, big));
}

TEST(PartialLog, FullSegmentIsReadByItsIndexOrElseDirectly) {
  TempFolder dir;
  const std::size_t big = std::size_t{900} << 10;
  const auto count = static_cast<std::uint32_t>(limits::kMaxSegmentBytes / big + 3);
  {
    auto log = PartialLog::open(dir.path()).value();
    for (std::uint32_t i = 0; i < count / 2; ++i) ASSERT_TRUE(log->append(record(i), payload(i, big)));
  }
  {  // the second half is appended after a restart
    auto log = PartialLog::open(dir.path()).value();
    for (std::uint32_t i = count / 2; i < count; ++i) ASSERT_TRUE(log->append(record(i), payload(i, big)));
  }
  const auto found = [&] {
    const auto log = PartialLog::open(dir.path()).value();
    std::vector<PartialRecord> records;
    for (const auto& entry : log->found()) {
      records.push_back(entry.record);
      EXPECT_EQ(log->read(entry.place).value().size(), big);
    }
    return records;
  };
  const auto all = found();
  ASSERT_EQ(all.size(), count);
  const auto index = dir.path() / "partials-000.idx";
  ASSERT_TRUE(std::filesystem::exists(index));
  EXPECT_FALSE(std::filesystem::exists(dir.path() / "partials-001.idx"));

  // Damage to the segment's first header has no effect, since the index has a copy of it...
  const auto scribble = [](const std::filesystem::path& path, std::streamoff at) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(at);
    file.put('!');
  };
  scribble(dir.path() / "partials-000.seg", 20);
  EXPECT_EQ(found(), all);
  // ...until the index is damaged, too: then the records behind the damage are left out.
  scribble(index, 20);
  EXPECT_EQ(found().size(), 3u);
}

}  // namespace
}  // namespace ls::coordinator
