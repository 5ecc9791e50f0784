// lightshaft-vdb FILE GRID GRID_BYTES MOST_BYTES: the program that worker/render/media/vdb_process.h starts
// to read a grid. It reads the grid GRID of FILE, writes the reply (vdb_reply.h) to the inherited file
// kHelperFd and exits. GRID_BYTES is the most memory that the grid's bricks may take. MOST_BYTES limits the
// memory of this program and of the reply together.
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <span>
#include <string>

#include "core/base/helper_program.h"
#include "core/base/spawn.h"
#include "util/sandbox/call_filter.h"
#include "worker/render/media/vdb_reply.h"

namespace {

constexpr rlim_t kMostCpuSeconds = 900;  // far more than the few seconds that the largest grids take

// Makes this process end when its parent ends, and limits its resources and system calls: processor time and
// the size of the reply to what a valid file can need, and memory to most_bytes, which is what the parent has
// left.
void confine(std::uint64_t grid_bytes, std::uint64_t most_bytes) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  const rlimit no_core{0, 0}, cpu{kMostCpuSeconds, kMostCpuSeconds + 10};
  ::setrlimit(RLIMIT_CORE, &no_core);
  ::setrlimit(RLIMIT_CPU, &cpu);
  const rlim_t reply_bytes = ls::render::kVdbBricksAt + ls::render::kVdbPadding +
                             std::min(grid_bytes, std::numeric_limits<rlim_t>::max() / 2);
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
  const std::uint64_t grid_bytes = std::strtoull(argv[3], nullptr, 10),
                      most_bytes = std::strtoull(argv[4], nullptr, 10);
  confine(grid_bytes, most_bytes);
  ls::render::VdbReply reply{};
  reply.magic = ls::render::kVdbMagic;
  ls::render::VdbGrid grid;
  std::string error;
  reply.code = ls::render::read_vdb(argv[1], argv[2], grid_bytes, grid, error);
  std::uint64_t bytes = 0;
  for (const ls::render::BrickTables bricks : grid.channels) bytes += bricks.bytes();
  if (bytes > most_bytes - std::min(taken(), most_bytes)) {
    reply.code = 2;
    error = "the grid of " + std::to_string(bytes >> 20) +
            " MiB needs more memory than the renderer has left of its limit";
  }
  std::snprintf(reply.error, sizeof reply.error, "%s", error.c_str());
  reply.shape = grid.shape;
  for (std::size_t c = 0; c < grid.channels.size(); ++c)
    reply.counts[c] = {grid.channels[c].nodes.size() / ls::render::kNodeEntries,
                       ls::render::BrickTables(grid.channels[c]).brick_count(),
                       grid.channels[c].halves.empty() ? 0u : 1u};
  bool written = write_all(&reply, sizeof reply, 0);
  // Pads the reply up to the offset of the bricks, even if none follow.
  written = written && ::ftruncate(ls::kHelperFd, ls::render::kVdbBricksAt) == 0;
  std::uint64_t at = ls::render::kVdbBricksAt;
  const auto append = [&](const auto& array) {
    const std::span part = std::as_bytes(std::span(array));
    written = written && write_all(part.data(), part.size(), at);
    at += (part.size() + 3) / 4 * 4;
  };
  for (const ls::render::OwnBricks& bricks : grid.channels) {
    if (reply.code != 0) break;
    append(bricks.table);
    append(bricks.nodes);
    append(bricks.floats);
    append(bricks.halves);
  }
  return written ? 0 : 1;
}
