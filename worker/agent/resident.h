// Memory use of a process.
#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <string>

namespace ls::worker {

// Returns the resident bytes of the process; 0 if it has ended.
inline std::uint64_t resident_bytes(pid_t process) {
  std::uint64_t total = 0, resident = 0;
  std::ifstream statm("/proc/" + std::to_string(process) + "/statm");
  statm >> total >> resident;
  return statm ? resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

}  // namespace ls::worker
