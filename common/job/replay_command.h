// The command line that renders one sample of a job again, for debugging.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/job/settings.h"

namespace ls {

// Returns "lightshaft render SCENE" with all options that determine the value of a sample; each word is
// quoted for a shell. `scene` is the scene's name in the job. `frame` is the frame number, for jobs with
// frames.
std::string replay_command(const std::string& scene, const JobSpec& spec,
                           std::optional<std::uint32_t> frame = {});
// Returns the command for one sample of the pixel (x, y). `command` is from the function above.
std::string replay_command(const std::string& command, int x, int y, std::uint64_t sample);

}  // namespace ls
