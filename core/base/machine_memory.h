// How much memory this process may use.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>

namespace ls {

// Returns the memory of the machine in bytes, or the limit of this process's control group if that is lower.
inline std::uint64_t usable_memory_bytes() {
  std::uint64_t bytes = static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
                        static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  std::uint64_t limit = 0;
  if (std::ifstream group("/sys/fs/cgroup/memory.max"); group >> limit && limit > 0)
    bytes = std::min(bytes, limit);
  return bytes;
}

}  // namespace ls
