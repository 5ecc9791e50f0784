// The memory limit (RLIMIT_DATA) of a process that loads OpenVDB files. The child process that reads a file
// may use as much memory as remains of this process's limit. The child's reply is a mapped file, which the
// kernel does not count towards RLIMIT_DATA, so this process lowers its limit by the size of the file while
// the file is mapped.
#pragma once

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <utility>

namespace ls::render {

inline constexpr std::uint64_t kNoDataLimit = ~std::uint64_t{0};

// Returns the number of bytes that this process may still allocate under the limit; kNoDataLimit if there is
// no limit.
inline std::uint64_t data_left() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kNoDataLimit;
  std::uint64_t size = 0, resident = 0, shared = 0, text = 0, library = 0, data = 0;
  std::ifstream("/proc/self/statm") >> size >> resident >> shared >> text >> library >> data;
  const std::uint64_t bytes = data * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  return limit.rlim_cur - std::min<std::uint64_t>(bytes, limit.rlim_cur);
}

// Lowers the limit by `bytes` while the object lives, to account for a mapped file of that size, which the
// kernel does not count.
class DataTaken {
 public:
  DataTaken() = default;
  explicit DataTaken(std::uint64_t bytes) : bytes_(lower(bytes)) {}
  DataTaken(DataTaken&& from) noexcept : bytes_(std::exchange(from.bytes_, 0)) {}
  DataTaken& operator=(DataTaken&& from) noexcept {
    std::swap(bytes_, from.bytes_);
    return *this;
  }
  ~DataTaken() { raise(bytes_); }

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  static std::uint64_t lower(std::uint64_t bytes) {
    const std::lock_guard lock(mutex());
    rlimit limit{};
    if (::getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return 0;
    bytes = std::min<std::uint64_t>(bytes, limit.rlim_cur);
    limit.rlim_cur -= bytes;
    return ::setrlimit(RLIMIT_DATA, &limit) == 0 ? bytes : 0;
  }
  static void raise(std::uint64_t bytes) {
    const std::lock_guard lock(mutex());
    rlimit limit{};
    if (bytes == 0 || ::getrlimit(RLIMIT_DATA, &limit) != 0) return;
    limit.rlim_cur += bytes;
    ::setrlimit(RLIMIT_DATA, &limit);
  }

  std::uint64_t bytes_ = 0;
};

}  // namespace ls::render
