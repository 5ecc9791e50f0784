// The machine that a race runs on, and the cores of it that everybody gets.
#pragma once

#include "cli/compare/results.h"
#include "common/base/error.h"

namespace ls::race {

// Keeps this process, its threads and the programs that it starts to so many of the cores it may use. Call it
// before any thread is made. resource_exhausted: there are fewer.
Result<void> use_cores(int count);

// "AMD EPYC 7B13, 2 of 8 cores". Loads are the kernel's average of a minute; negative: not known.
std::string machine_words(int cores);
double load_average();

}  // namespace ls::race
