// lightshaft-vdb FILE GRID MOST_VALUES MOST_BYTES: the program that worker/render/media/vdb_process.h starts
// to read a grid. It reads the grid GRID of FILE, writes the reply (vdb_reply.h) to the inherited file
// kHelperFd and exits. MOST_VALUES is the largest number of values of the grid. MOST_BYTES limits the memory
// of this program and of the reply together.
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "core/base/helper_program.h"
#include "core/base/spawn.h"
#include "util/sandbox/call_filter.h"
#include "worker/render/media/vdb_reply.h"

namespace {

constexpr rlim_t kMostCpuSeconds = 900;  // far more than the few seconds that the largest grids take

// Makes this process end when its parent ends, and limits its resources and system calls: processor time and
// the size of the reply to what a valid file can need, and memory to most_bytes, which is what the parent has
// left.
void confine(std::uint64_t most_values, std::uint64_t most_bytes) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  const rlimit no_core{0, 0}, cpu{kMostCpuSeconds, kMostCpuSeconds + 10};
  ::setrlimit(RLIMIT_CORE, &no_core);
  ::setrlimit(RLIMIT_CPU, &cpu);
  const rlim_t reply_bytes =
      ls::render::kVdbValuesAt + 4 * std::min(most_values, std::numeric_limits<rlim_t>::max() / 8);
  const rlimit file{reply_bytes, reply_bytes};
  ::signal(SIGXFSZ, SIG_IGN);
  ::setrlimit(RLIMIT_FSIZE, &file);
  const rlimit data{most_bytes, most_bytes};
  if (most_bytes != ls::render::kNoDataLimit) ::setrlimit(RLIMIT_DATA, &data);
  ls::limit_calls();
}

// Returns the peak memory of this process so far, in bytes.
std::uint64_t taken() {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  return static_cast<std::uint64_t>(used.ru_maxrss) * 1024;
}

bool write_all(const void* from, std::uint64_t bytes, std::uint64_t at) {
  constexpr std::uint64_t kAtOnce = 1 << 30;
  const auto* data = static_cast<const char*>(from);
  while (bytes > 0) {
    const ssize_t n = ::pwrite(ls::kHelperFd, data, std::min(bytes, kAtOnce), static_cast<off_t>(at));
    if (n <= 0) return false;
    data += n, at += static_cast<std::uint64_t>(n), bytes -= static_cast<std::uint64_t>(n);
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return ls::answer_person("lightshaft-vdb", LIGHTSHAFT_VERSION, argc, argv);
  const std::uint64_t most_values = std::strtoull(argv[3], nullptr, 10),
                      most_bytes = std::strtoull(argv[4], nullptr, 10);
  confine(most_values, most_bytes);
  ls::render::VdbReply reply{};
  reply.magic = ls::render::kVdbMagic;
  LsVdbGrid grid{};
  reply.code = ls_vdb_read(argv[1], argv[2], most_values, &grid, reply.error, sizeof reply.error);
  const std::uint64_t values = reply.code == 0 ? 4 * ls::render::values_of(grid) : 0;
  if (values > most_bytes - std::min(taken(), most_bytes)) {
    reply.code = 2;
    std::snprintf(reply.error, sizeof reply.error,
                  "the grid of %llu MiB needs more memory than the renderer has left of its limit",
                  static_cast<unsigned long long>(values >> 20));
  }
  reply.grid = grid;
  reply.grid.values = nullptr;
  bool written = write_all(&reply, sizeof reply, 0);
  // Pads the reply up to the offset of the values, even if no values follow.
  written = written && ::ftruncate(ls::kHelperFd, ls::render::kVdbValuesAt) == 0;
  if (reply.code == 0) written = written && write_all(grid.values, values, ls::render::kVdbValuesAt);
  ls_vdb_free(&grid);
  return written ? 0 : 1;
}
