#include "cli/local/instructions.h"

#include <linux/perf_event.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace ls::cli {
namespace {

std::string why(int error) {
  switch (error) {
    case EACCES:
    case EPERM:
      return "the system keeps the processor's counters from its users: kernel.perf_event_paranoid of 2 or "
             "less allows them";
    case ENOENT:
    case ENODEV:
    case EOPNOTSUPP:
      return "this machine has no counter of instructions, as most virtual machines";
    default:
      return std::string("no counter of instructions: ") + std::strerror(error);
  }
}

}  // namespace

int InstructionCounter::of_this_thread() {
  perf_event_attr what{};
  what.size = sizeof what;
  what.type = PERF_TYPE_HARDWARE;
  what.config = PERF_COUNT_HW_INSTRUCTIONS;
  what.exclude_kernel = 1;
  what.exclude_hv = 1;
  what.inherit = 1;
  constexpr int kThisThread = 0, kAnyCpu = -1, kNoGroup = -1;
  return static_cast<int>(
      syscall(SYS_perf_event_open, &what, kThisThread, kAnyCpu, kNoGroup, PERF_FLAG_FD_CLOEXEC));
}

Result<InstructionCounter> InstructionCounter::open(int (*opener)()) {
  const int fd = opener();
  if (fd < 0) return fail(Errc::unavailable, why(errno));
  return InstructionCounter(fd);
}

InstructionCounter::InstructionCounter(InstructionCounter&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)) {}
InstructionCounter::~InstructionCounter() {
  if (fd_ >= 0) close(fd_);
}

Result<std::uint64_t> InstructionCounter::read() const {
  std::uint64_t count = 0;
  if (::read(fd_, &count, sizeof count) != static_cast<ssize_t>(sizeof count))
    return fail(Errc::internal, "the counter of instructions cannot be read");
  return count;
}

VariantBitsList measure_variants(const std::vector<std::string>& names, double paths,
                                 const Result<InstructionCounter>& counter,
                                 const std::function<Digest(const std::string&)>& render) {
  const auto count = [&] { return counter.and_then([](const InstructionCounter& c) { return c.read(); }); };
  VariantBitsList out;
  for (const std::string& name : names) {
    const auto before = count();
    VariantBits v{name, render(name), std::nullopt};
    const auto after = count();
    if (before && after && *after > *before)
      v.instructions = static_cast<double>(*after - *before) / paths;
    else if (out.uncounted.empty())
      out.uncounted = !before  ? before.error().message
                      : !after ? after.error().message
                               : "the counter of instructions stands still";
    out.all.push_back(std::move(v));
  }
  return out;
}

}  // namespace ls::cli
