// lightshaft-vdb's reply, and replies of programs that stand in for one that a file made to harm has taken
// over.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <thread>

#include "core/base/spawn.h"
#include "tests/unit/nvdb/nvdb_builder.h"
#include "util/sandbox/call_filter.h"
#include "worker/render/media/vdb_process.h"
#include "worker/render/media/vdb_reply.h"
#include "worker/render/vdb/nvdb.h"

namespace ls::render {
namespace {

using testing::HasSubstr;

class VdbProcess : public testing::Test {
 protected:
  VdbProcess() {
    char name[] = "/tmp/lightshaft-vdb-XXXXXX";
    folder_ = ::mkdtemp(name);
  }
  ~VdbProcess() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path file(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }
  // A program that answers with these words of a shell.
  std::filesystem::path program(const std::string& words) {
    const auto path = file("program", "#!/bin/sh\n" + words + "\n");
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    return path;
  }
  Result<VdbFile> read_by(const std::string& words) {
    return VdbFile::read(folder_ / "none.vdb", "", 1 << 20, program(words));
  }
  // ... that answers with a reply and values.
  Result<VdbFile> answered(const VdbReply& reply, const std::vector<float>& values,
                           const std::string& then = "") {
    std::string bytes(kVdbValuesAt, '\0');
    std::memcpy(bytes.data(), &reply, sizeof reply);
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
    return read_by("cat '" + file("reply", bytes).string() + "' >&3\n" + then);
  }
  std::filesystem::path fifo(const std::string& name) {
    EXPECT_EQ(::mkfifo((folder_ / name).c_str(), 0600), 0);
    return folder_ / name;
  }

 private:
  std::filesystem::path folder_;
};

VdbReply reply_of(int x, int y, int z) {
  VdbReply reply{};
  reply.magic = kVdbMagic;
  reply.grid.channels = 1;
  reply.grid.size[0] = x, reply.grid.size[1] = y, reply.grid.size[2] = z;
  return reply;
}

TEST_F(VdbProcess, GridFromTheProcessEqualsOneReadDirectly) {
  const std::string bytes = test::NvdbBuilder().file();
  LsVdbGrid here{};
  decode_nvdb(std::as_bytes(std::span(bytes)), "", 1 << 20, here);

  const auto there = VdbFile::read(file("a.nvdb", bytes), "density", 1 << 20);

  ASSERT_TRUE(there) << there.error().message;
  const std::uint64_t count = values_of(here);
  ASSERT_EQ(values_of(there->grid()), count);
  EXPECT_TRUE(std::equal(here.values, here.values + count, there->grid().values));
  EXPECT_TRUE(std::equal(here.index_to_scene, here.index_to_scene + 16, there->grid().index_to_scene));
  delete[] here.values;
}

TEST_F(VdbProcess, RefusalHasAReason) {
  const auto garbage = VdbFile::read(file("a.vdb", "no grid at all"), "", 1 << 20);
  const auto large = VdbFile::read(file("a.nvdb", test::NvdbBuilder().file()), "", 100);

  ASSERT_FALSE(garbage);
  EXPECT_EQ(garbage.error().code, Errc::invalid_argument);
  EXPECT_THAT(garbage.error().message, HasSubstr("not a readable OpenVDB"));
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().code, Errc::resource_exhausted);
  EXPECT_THAT(large.error().message, HasSubstr("the limit is 100"));
}

TEST_F(VdbProcess, FileThatCrashesItsReaderIsAnError) {
  const auto crashed = read_by("kill -SEGV $$");
  ASSERT_FALSE(crashed);
  EXPECT_EQ(crashed.error().code, Errc::invalid_argument);
  EXPECT_THAT(crashed.error().message, HasSubstr("crashes the library that reads it (Segmentation fault)"));

  const auto endless = read_by("kill -XCPU $$");
  ASSERT_FALSE(endless);
  EXPECT_EQ(endless.error().code, Errc::resource_exhausted);
  const auto eaten = read_by("kill -KILL $$");
  ASSERT_FALSE(eaten);
  EXPECT_THAT(eaten.error().message, HasSubstr("not enough memory"));
  EXPECT_FALSE(read_by("exit 3"));
}

TEST_F(VdbProcess, ReplyIsValidated) {
  VdbReply sound = reply_of(2, 1, 1), endless = sound, three = reply_of(1, 1, 1), two = three,
           refused = reply_of(0, 0, 0);
  endless.grid.index_to_scene[3] = std::numeric_limits<double>::infinity();
  three.grid.channels = 3, two.grid.channels = 2;
  refused.code = 1;
  std::fill(std::begin(refused.error), std::end(refused.error), 'x');  // without an end

  EXPECT_TRUE(answered(sound, {1, 2}));
  EXPECT_TRUE(answered(three, {1, 2, 3}));
  EXPECT_FALSE(answered(three, {1, 2}));
  EXPECT_FALSE(answered(two, {1, 2}));
  EXPECT_FALSE(answered(sound, {1}));
  EXPECT_FALSE(answered(sound, {1, -1}));
  EXPECT_FALSE(answered(sound, {1, std::nanf("")}));
  EXPECT_FALSE(answered(endless, {1, 2}));
  EXPECT_FALSE(answered(reply_of(-2, -1, 1), {1, 2}));
  EXPECT_FALSE(answered(reply_of(0, 1, 1), {1, 2}));
  EXPECT_FALSE(answered(reply_of(1 << 30, 1 << 30, 1 << 30), {1, 2}));
  EXPECT_FALSE(answered(VdbReply{}, {1, 2}));
  EXPECT_FALSE(read_by("printf abc >&3"));
  EXPECT_FALSE(read_by("true"));
  refused.error[0] = 0;
  EXPECT_THAT(answered(refused, {}).error().message, HasSubstr("nonsense"));
  refused.error[0] = 'x';
  const auto told = answered(refused, {});
  ASSERT_FALSE(told);
  EXPECT_EQ(told.error().message.size(), sizeof refused.error - 1);
}

TEST_F(VdbProcess, LeftoverProcessesCannotChangeTheReply) {
  const auto go = fifo("go"), done = fifo("done");
  const auto cut = answered(reply_of(2, 1, 1), {1, 2},
                            "{ read word <'" + go.string() + "'; (: >/proc/self/fd/3); echo cut >'" +
                                done.string() + "'; } 2>/dev/null &");
  ASSERT_TRUE(cut) << cut.error().message;
  std::ofstream(go) << "go\n";
  std::string word;
  std::ifstream(done) >> word;
  EXPECT_EQ(word, "cut");  // it has tried
  EXPECT_EQ(cut->grid().values[1], 2);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose shadow is larger than any limit
constexpr std::uint64_t kMiB = 1 << 20;
std::uint64_t limit() {
  rlimit data{};
  ::getrlimit(RLIMIT_DATA, &data);
  return data.rlim_cur;
}
// What `run` gives in a process that may take so many bytes more.
int with_limit(std::uint64_t more, const std::function<int()>& run) {
  const pid_t pid = ::fork();
  if (pid == 0) {
    rlimit data{1 << 30, 1 << 30};
    ::setrlimit(RLIMIT_DATA, &data);
    data.rlim_cur = data.rlim_max = (1 << 30) - data_left() + more;
    ::setrlimit(RLIMIT_DATA, &data);
    ::_exit(run());
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// 258^3 values, 66 MiB: read they fit into any of these limits, but the reply takes as much again.
TEST_F(VdbProcess, GridAndReplyMustFitIntoTheRenderersRemainingMemory) {
  test::NvdbBuilder builder;
  builder.hi = {255, 255, 255};
  const auto path = file("large.nvdb", builder.file());
  const auto read_with = [&](std::uint64_t more) {
    return with_limit(more, [&] {
      const auto read = VdbFile::read(path, "", 1 << 25);
      if (!read) return read.error().code == Errc::resource_exhausted ? 1 : 2;
      return values_of(read->grid()) == 258 * 258 * 258 ? 0 : 3;
    });
  };

  EXPECT_EQ(read_with(512 * kMiB), 0);
  EXPECT_EQ(read_with(120 * kMiB), 1);
  EXPECT_EQ(read_with(60 * kMiB), 1);  // not even read: no fault of the file
}

TEST_F(VdbProcess, MappedReplyCountsTowardsTheLimit) {
  const auto path = file("a.nvdb", test::NvdbBuilder().file());
  const int failed = with_limit(512 * kMiB, [&] {
    const std::uint64_t before = limit();
    {
      const auto read = VdbFile::read(path, "", 1 << 20);
      const std::uint64_t taken = kVdbValuesAt + 4 * values_of(read->grid());
      if (limit() != before - taken) return 1;
    }
    return limit() == before ? 0 : 2;
  });
  EXPECT_EQ(failed, 0);
}
#endif

TEST_F(VdbProcess, MissingProgramIsNotReportedAsABadFile) {
  const auto missing = VdbFile::read("a.vdb", "", 1 << 20, "/nowhere/lightshaft-vdb");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, Errc::internal);
  EXPECT_THAT(missing.error().message, HasSubstr("/nowhere/lightshaft-vdb"));
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they have no sandbox
// Renderers in their sandbox may not signal their helpers. The stand-in asks to be ended as lightshaft-vdb
// does.
TEST_F(VdbProcess, EndsWhenItsLoadIsStoppedInASandbox) {
  const auto runs = fifo("runs");
  const auto helper =
      program("exec setpriv --pdeathsig KILL sh -c ': >> " + runs.string() + "; exec sleep 60'");
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(20);  // ends a wait that would have no end
    ::setsid();   // as the agent has renderers do
    if (!limit_calls()) ::_exit(2);
    std::atomic<bool> stop{false};
    const std::jthread once_it_runs([&] {
      if (::open(runs.c_str(), O_RDONLY) >= 0) stop = true;
    });
    const Descriptor reply(::memfd_create("reply", MFD_CLOEXEC));
    const auto end = run_helper(helper, {}, reply.fd, &stop);
    ::_exit(end && WIFSIGNALED(end->status) && WTERMSIG(end->status) == SIGKILL ? 0 : 1);
  }

  int status = 0;
  ::waitpid(child, &status, 0);

  ASSERT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}
#endif

}  // namespace
}  // namespace ls::render
