// lightshaft-vdb FILE GRID MOST_VALUES: reads a grid for worker/render/vdb_process.h, and ends. The reply
// goes to the file that it inherits as kVdbReplyFd.
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>

#include "worker/render/vdb_reply.h"

namespace {

constexpr rlim_t kMostCpuSeconds = 900;  // the largest grids take seconds

// It lives no longer than who asked, and takes no more than a file can be worth.
void confine() {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  const rlimit no_core{0, 0}, cpu{kMostCpuSeconds, kMostCpuSeconds + 10};
  ::setrlimit(RLIMIT_CORE, &no_core);
  ::setrlimit(RLIMIT_CPU, &cpu);
}

bool write_all(const void* from, std::uint64_t bytes, std::uint64_t at) {
  constexpr std::uint64_t kAtOnce = 1 << 30;
  const auto* data = static_cast<const char*>(from);
  while (bytes > 0) {
    const ssize_t n =
        ::pwrite(ls::render::kVdbReplyFd, data, std::min(bytes, kAtOnce), static_cast<off_t>(at));
    if (n <= 0) return false;
    data += n, at += static_cast<std::uint64_t>(n), bytes -= static_cast<std::uint64_t>(n);
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  confine();
  ls::render::VdbReply reply{};
  reply.magic = ls::render::kVdbMagic;
  LsVdbGrid grid{};
  reply.code = ls_vdb_read(argv[1], argv[2], std::strtoull(argv[3], nullptr, 10), &grid, reply.error,
                           sizeof reply.error);
  reply.grid = grid;
  reply.grid.values = nullptr;
  bool written = write_all(&reply, sizeof reply, 0);
  // Padded, so that the file always reaches to where values begin.
  written = written && ::ftruncate(ls::render::kVdbReplyFd, ls::render::kVdbValuesAt) == 0;
  if (reply.code == 0)
    written = written && write_all(grid.values, 4 * ls::render::values_of(grid), ls::render::kVdbValuesAt);
  ls_vdb_free(&grid);
  return written ? 0 : 1;
}
