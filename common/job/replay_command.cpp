#include "common/job/replay_command.h"

#include <fmt/format.h>

#include "common/base/safe_text.h"

namespace ls {

std::string replay_command(const std::string& scene, const JobSpec& spec,
                           std::optional<std::uint32_t> frame) {
  std::string command = "lightshaft render " + shell_word(scene.starts_with('-') ? "./" + scene : scene);
  if (spec.seed) command += fmt::format(" --seed {}", *spec.seed);
  if (frame) command += fmt::format(" --frames {}", *frame);
  if (spec.size) command += fmt::format(" --size {}x{}", spec.size->width, spec.size->height);
  if (spec.integrator) command += " --integrator " + shell_word(*spec.integrator);
  for (const auto& [name, value] : spec.defines) command += " -D " + shell_word(name + "=" + value);
  return command;
}

std::string replay_command(const std::string& command, int x, int y, std::uint64_t sample) {
  return fmt::format("{} --pixel {},{} --sample {}", command, x, y, sample);
}

}  // namespace ls
