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
#include "tests/unit/nvdb/bricks_values.h"
#include "tests/unit/nvdb/nvdb_builder.h"
#include "util/sandbox/call_filter.h"
#include "worker/render/media/vdb_process.h"
#include "worker/render/media/vdb_reply.h"
#include "worker/render/vdb/nvdb.h"

namespace ls::render {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kMost = 1 << 25;  // bytes of a grid

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
    return VdbFile::read(folder_ / "none.vdb", "", kMost, program(words));
  }
  // ... that answers with a reply and what follows it.
  Result<VdbFile> answered(const VdbReply& reply, const std::vector<OwnBricks>& channels,
                           const std::string& then = "") {
    std::string bytes(kVdbBricksAt, '\0');
    std::memcpy(bytes.data(), &reply, sizeof reply);
    const auto append = [&](const auto& array) {
      bytes.append(reinterpret_cast<const char*>(array.data()), array.size() * sizeof(array[0]));
    };
    for (const OwnBricks& b : channels) append(b.table), append(b.nodes), append(b.floats), append(b.halves);
    return read_by("cat '" + file("reply", bytes).string() + "' >&3\n" + then);
  }
  std::filesystem::path fifo(const std::string& name) {
    EXPECT_EQ(::mkfifo((folder_ / name).c_str(), 0600), 0);
    return folder_ / name;
  }

 private:
  std::filesystem::path folder_;
};

// The bricks of a box of 2 x 1 x 1 values. They are of float32 unless all values are halves.
OwnBricks bricks_of(const std::vector<float>& values) {
  return make_bricks(tree_of({2, 1, 1}, values), 0, kMost).value();
}
VdbReply reply_of(int x, int y, int z, const std::vector<OwnBricks>& channels) {
  VdbReply reply{};
  reply.magic = kVdbMagic;
  reply.shape.channels = static_cast<int>(channels.size());
  reply.shape.size[0] = x, reply.shape.size[1] = y, reply.shape.size[2] = z;
  for (std::size_t c = 0; c < channels.size(); ++c)
    reply.counts[c] = {channels[c].nodes.size() / kNodeEntries, BrickTables(channels[c]).brick_count(),
                       channels[c].halves.empty() ? 0u : 1u};
  return reply;
}

TEST_F(VdbProcess, GridFromTheProcessEqualsOneReadDirectly) {
  const std::string bytes = test::NvdbBuilder().file();
  const VdbGrid here = test::with_bricks(decode_nvdb(std::as_bytes(std::span(bytes)), "", kMost));

  const auto there = VdbFile::read(file("a.nvdb", bytes), "density", kMost);

  ASSERT_TRUE(there) << there.error().message;
  EXPECT_TRUE(Bricks(here.shape.size_of_box(), here.shape.lead_of_box(), here.channels[0]) ==
              there->channel(0));
  EXPECT_TRUE(
      std::equal(here.shape.index_to_scene, here.shape.index_to_scene + 16, there->shape().index_to_scene));
}

TEST_F(VdbProcess, RefusalHasAReason) {
  const auto garbage = VdbFile::read(file("a.vdb", "no grid at all"), "", kMost);
  const auto large = VdbFile::read(file("a.nvdb", test::NvdbBuilder().file()), "", 100);

  ASSERT_FALSE(garbage);
  EXPECT_EQ(garbage.error().code, Errc::invalid_argument);
  EXPECT_THAT(garbage.error().message, HasSubstr("not a readable OpenVDB"));
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().code, Errc::resource_exhausted);
  EXPECT_THAT(large.error().message, HasSubstr("of 26 x 10 x 10 voxels takes more than 0 MiB of memory"));
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
  const OwnBricks some = bricks_of({.1f, 2}), halves = bricks_of({1, 2});
  const VdbReply sound = reply_of(2, 1, 1, {some}), three = reply_of(2, 1, 1, {some, some, some});
  VdbReply endless = sound, two = reply_of(2, 1, 1, {some, some}), shifted = sound, many = sound,
           none = sound, refused{};
  endless.shape.index_to_scene[3] = std::numeric_limits<double>::infinity();
  shifted.shape.lead[1] = 128;
  many.counts[0].bricks = std::uint64_t{1} << 62;
  none.counts[0].nodes = 0;
  refused.magic = kVdbMagic;
  refused.code = 1;
  std::fill(std::begin(refused.error), std::end(refused.error), 'x');  // without an end
  OwnBricks cut = some, negative = some, nan = some, wild = some;
  cut.floats.pop_back();
  negative.floats.back() = -1;
  nan.floats.back() = std::nanf("");
  wild.nodes.back() = 7;

  const auto good = answered(sound, {some});
  ASSERT_TRUE(good) << good.error().message;
  EXPECT_EQ(good->channel(0).at(1, 0, 0), 2);
  EXPECT_TRUE(answered(three, {some, some, some}));
  const VdbReply as_halves = reply_of(2, 1, 1, {halves});
  const auto good_halves = answered(as_halves, {halves});
  ASSERT_TRUE(good_halves) << good_halves.error().message;
  EXPECT_EQ(good_halves->channel(0).at(1, 0, 0), 2);
  EXPECT_FALSE(answered(sound, {halves}));
  for (const std::uint16_t bad : {0x7c00, 0x7e00, 0x8001, 0xbc00}) {  // infinite, not a number, negative
    OwnBricks other = halves;
    other.halves.back() = bad;
    EXPECT_FALSE(answered(as_halves, {other})) << bad;
  }
  EXPECT_FALSE(answered(three, {some, some}));
  EXPECT_FALSE(answered(two, {some, some}));
  EXPECT_FALSE(answered(sound, {cut}));
  EXPECT_FALSE(answered(sound, {negative}));
  EXPECT_FALSE(answered(sound, {nan}));
  EXPECT_FALSE(answered(sound, {wild}));
  EXPECT_FALSE(answered(endless, {some}));
  EXPECT_FALSE(answered(shifted, {some}));
  EXPECT_FALSE(answered(many, {some}));
  EXPECT_FALSE(answered(none, {some}));
  EXPECT_FALSE(answered(reply_of(-2, -1, 1, {some}), {some}));
  EXPECT_FALSE(answered(reply_of(0, 1, 1, {some}), {some}));
  EXPECT_FALSE(answered(reply_of(200, 1, 1, {some}), {some}));  // a table of two nodes
  EXPECT_FALSE(answered(reply_of(1 << 14, 1 << 14, 1 << 14, {some}), {some}));
  EXPECT_FALSE(answered(reply_of(1 << 30, 1 << 30, 1 << 30, {some}), {some}));
  EXPECT_FALSE(answered(VdbReply{}, {some}));
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
  const OwnBricks some = bricks_of({1, 2});
  const auto cut = answered(reply_of(2, 1, 1, {some}), {some},
                            "{ read word <'" + go.string() + "'; (: >/proc/self/fd/3); echo cut >'" +
                                done.string() + "'; } 2>/dev/null &");
  ASSERT_TRUE(cut) << cut.error().message;
  std::ofstream(go) << "go\n";
  std::string word;
  std::ifstream(done) >> word;
  EXPECT_EQ(word, "cut");  // it has tried
  EXPECT_EQ(cut->channel(0).at(1, 0, 0), 2);
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

// A file of 8 nodes that are full of leaves: 64 MiB. No two of these are equal.
std::string large_file() {
  const test::NvdbBuilder builder;
  const std::uint64_t node_bytes = builder.leaf(0) - builder.lower(), upper = builder.upper();
  const std::string part = builder.buffer();
  std::string b = part.substr(0, builder.lower());
  float next = 1;
  for (int n = 0; n < 8; ++n) {
    const auto child = static_cast<std::uint32_t>((n & 1) * 32 * 32 + (n >> 1 & 1) * 32 + (n >> 2));
    b[upper + 4128 + child / 8] = static_cast<char>(b[upper + 4128 + child / 8] | 1 << child % 8);
    test::NvdbBuilder::put(b, upper + builder.upper_table() + 8 * child, b.size() - upper);
    std::string node = part.substr(builder.lower(), node_bytes);
    std::fill_n(node.begin() + 544, 512, '\xff');
    for (std::uint64_t i = 0; i < 4096; ++i)
      test::NvdbBuilder::put(node, builder.lower_table() + 8 * i, node_bytes + i * builder.leaf_bytes());
    b += node;
    for (int i = 0; i < 4096; ++i) {
      std::string leaf = part.substr(builder.leaf(0), builder.leaf_bytes());
      test::NvdbBuilder::put(leaf, builder.leaf_table(), next++);
      b += leaf;
    }
  }
  test::NvdbBuilder::put(b, 32, std::uint64_t{b.size()});
  for (std::uint64_t k = 0; k < 3; ++k)
    test::NvdbBuilder::put(b, test::NvdbBuilder::kRoot + 12 + 4 * k, builder.origin[k] + 255);
  return builder.file(b);
}

TEST_F(VdbProcess, GridAndReplyMustFitIntoTheRenderersRemainingMemory) {
  const auto path = file("large.nvdb", large_file());
  const auto read_with = [&](std::uint64_t more) {
    return with_limit(more, [&] {
      const auto read = VdbFile::read(path, "", std::uint64_t{1} << 30);
      if (!read) return read.error().code == Errc::resource_exhausted ? 1 : 2;
      return read->channel(0).at(1, 1, 1) == 1 ? 0 : 3;
    });
  };

  // The file takes 67 MiB, its leaves 64, its bricks 92, and the reply as much again.
  EXPECT_EQ(read_with(700 * kMiB), 0);
  int last = 1;
  for (std::uint64_t more = 60; more < 700; more += 40) {
    const int code = read_with(more * kMiB);
    EXPECT_TRUE(code == last || (last == 1 && code == 0)) << more << " MiB: " << code;
    last = code;
  }
}

TEST_F(VdbProcess, MappedReplyCountsTowardsTheLimit) {
  const auto path = file("a.nvdb", test::NvdbBuilder().file());
  const int failed = with_limit(512 * kMiB, [&] {
    const std::uint64_t before = limit();
    {
      const auto read = VdbFile::read(path, "", kMost);
      const std::uint64_t taken = kVdbBricksAt + read->channel(0).bytes();
      if (limit() != before - taken) return 1;
    }
    return limit() == before ? 0 : 2;
  });
  EXPECT_EQ(failed, 0);
}
#endif

TEST_F(VdbProcess, MissingProgramIsNotReportedAsABadFile) {
  const auto missing = VdbFile::read("a.vdb", "", kMost, "/nowhere/lightshaft-vdb");
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
