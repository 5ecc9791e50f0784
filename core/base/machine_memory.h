// How much memory this process may use.
#pragma once

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>

namespace ls {

// Returns the memory of the machine in bytes, or the lowest of the limits on this process if that is lower:
// of its control group, and RLIMIT_DATA and RLIMIT_AS of the process itself.
inline std::uint64_t usable_memory_bytes() {
  std::uint64_t bytes = static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
                        static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  std::uint64_t limit = 0;
  if (std::ifstream group("/sys/fs/cgroup/memory.max"); group >> limit && limit > 0)
    bytes = std::min(bytes, limit);
  for (const auto which : {RLIMIT_DATA, RLIMIT_AS})
    if (rlimit of{}; ::getrlimit(which, &of) == 0 && of.rlim_cur != RLIM_INFINITY)
      bytes = std::min<std::uint64_t>(bytes, of.rlim_cur);
  return bytes;
}

}  // namespace ls
