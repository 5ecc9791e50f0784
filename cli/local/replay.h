// `lightshaft render --pixel X,Y --sample N`: renders one sample of one pixel again, for debugging.
#pragma once

#include <cstdint>
#include <utility>

#include "cli/local/local_scene.h"

namespace ls::cli {

// Prints the sample's value; returns the exit code.
int replay_sample(const LocalScene& scene, const JobSpec& spec, int threads, std::pair<int, int> pixel,
                  std::uint64_t sample);

}  // namespace ls::cli
