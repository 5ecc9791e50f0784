// Which fault the mutated copy of the sources has: run.py writes a test of this number beside each place that
// it can break, so that one build holds all of them. 0, or LIGHTSHAFT_MUTANT unset: none.
#pragma once

#include <cstdlib>

namespace ls {

inline const int kMutant = [] {
  const char* number = std::getenv("LIGHTSHAFT_MUTANT");
  return number != nullptr ? std::atoi(number) : 0;
}();

}  // namespace ls
