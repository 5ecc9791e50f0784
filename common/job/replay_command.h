// The command that renders one sample of a job again on its own, for a person to copy and debug.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/job/settings.h"

namespace ls {

// "lightshaft render SCENE" with all options that determine the value of a sample, each word quoted for a
// shell. `scene`: the job's name for it. `frame`: for sequences.
std::string replay_command(const std::string& scene, const JobSpec& spec,
                           std::optional<std::uint32_t> frame = {});
// The command for one sample; `command` comes from the function above.
std::string replay_command(const std::string& command, int x, int y, std::uint64_t sample);

}  // namespace ls
