// Describes the machine that a race runs on, restricts the race to some of its cores, and measures how busy
// other processes keep it.
#pragma once

#include "common/base/error.h"
#include "compare/results.h"

namespace ls::race {

// Restricts this process and its threads to `count` of its cores. Call before any thread is created.
// resource_exhausted: the process has fewer cores.
Result<void> use_cores(int count);

// Returns the machine's processor and the number of cores used, such as "AMD EPYC 7B13, 2 of 8 cores".
std::string machine_words(int cores);
double load_average();  // the kernel's load average over one minute; negative: unknown

// Measures how much CPU time other processes use from the construction of this object on.
class Others {
 public:
  Others() : start_(taken()) {}
  // Returns the share, 0 to 1, of the time of all cores that other processes have used. Negative: unknown.
  double share() const;

 private:
  struct Times {
    // Seconds, summed over all cores: all time since boot (0: unknown), the busy part of it, and the CPU time
    // of this process
    double total = 0, busy = 0, own = 0;
  };
  static Times taken();
  Times start_;
};

}  // namespace ls::race
