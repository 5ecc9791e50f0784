// Clocks and conversions of time. Code that must be testable at any time gets a Clock or the time as an
// argument. SystemClock and the functions below read the system's clocks.
#pragma once

#include <time.h>

#include <chrono>
#include <cstdint>

namespace ls {

using Duration = std::chrono::nanoseconds;
// A point in time of the monotonic clock; not comparable between processes.
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Duration>;

class Clock {
 public:
  virtual ~Clock() = default;
  virtual TimePoint now() const = 0;
};

class SystemClock final : public Clock {
 public:
  TimePoint now() const override {
    return std::chrono::time_point_cast<Duration>(std::chrono::steady_clock::now());
  }
};

// The wall clock: nanoseconds since 1970 (UTC). It may be set while a program runs.
inline std::int64_t system_unix_ns() {
  return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()).count();
}

inline double system_unix_seconds() { return static_cast<double>(system_unix_ns()) / 1e9; }

// Returns the CPU time of the calling thread.
inline double thread_cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

inline double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }
inline Duration from_seconds(double s) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s));
}

}  // namespace ls
