// The machine that a race runs on, and the cores that it may use.
#pragma once

#include "common/base/error.h"
#include "compare/results.h"

namespace ls::race {

// Restricts this process and its threads to `count` of its cores. Call before any thread is created.
// resource_exhausted: the process has fewer cores.
Result<void> use_cores(int count);

// Returns the machine's processor and the number of cores used, such as "AMD EPYC 7B13, 2 of 8 cores".
std::string machine_words(int cores);
double load_average();  // the kernel's one-minute average; negative: unknown

// Measures the load of other processes since its construction.
class Others {
 public:
  Others() : start_(taken()) {}
  // Returns the share, 0 to 1, of all cores' time that other processes have used. Negative: unknown.
  double share() const;

 private:
  struct Times {
    double total = 0, busy = 0, own = 0;  // seconds; total 0: unknown
  };
  static Times taken();
  Times start_;
};

}  // namespace ls::race
