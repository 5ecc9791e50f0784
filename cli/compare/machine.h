// The machine that a race runs on, and the cores of it that everybody gets.
#pragma once

#include <sys/resource.h>

#include "cli/compare/results.h"
#include "common/base/error.h"

namespace ls::race {

// Keeps this process, its threads and the programs that it starts to so many of the cores it may use. Call it
// before any thread is made. resource_exhausted: there are fewer.
Result<void> use_cores(int count);

// "AMD EPYC 7B13, 2 of 8 cores".
std::string machine_words(int cores);
double cpu_seconds(const rusage& usage);  // user and system
double load_average();                    // the kernel's, of a minute; negative: not known

// How busy others are: counts from when it is made.
class Others {
 public:
  Others() : start_(taken()) {}
  // Of the time of all cores: what neither this process nor the programs that it waited for had. Negative:
  // not known.
  double share() const;

 private:
  struct Times {
    double total = 0, busy = 0, own = 0;  // seconds; total 0: not known
  };
  static Times taken();
  Times start_;
};

}  // namespace ls::race
