// The command that renders one sample of a job again, on its own: what a person copies to look for a fault.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/job/settings.h"

namespace ls {

// "lightshaft render SCENE" with all of the spec that decides the value of a sample, each word ready for a
// shell. `scene`: as the job calls it. `frame`: of a sequence.
std::string replay_command(const std::string& scene, const JobSpec& spec,
                           std::optional<std::uint32_t> frame = {});
// Of one sample: `command` is of the above.
std::string replay_command(const std::string& command, int x, int y, std::uint64_t sample);

}  // namespace ls
