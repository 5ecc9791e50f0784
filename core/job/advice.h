// Advises the user, in a sentence, how to go on with an image whose error figures are not trusted yet.
#pragma once

#include <string>

#include "core/image/error/convergence.h"

namespace ls {

struct Advised {
  std::string job;         // id of the job; a command that goes on with it is named
  double relmse = 0;       // of the image so far; 0: none is known yet
  bool lit = true;         // some sample has found light
  double spp_done = 0;     // samples per pixel so far
  bool goes_on = false;    // the job gets more samples by itself: it is not over, paused or held
  bool can_extend = true;  // the job is done
};

// Empty: the figures are trusted.
std::string advice_on(const ConvergenceStatus& status, const Advised& job);

}  // namespace ls
