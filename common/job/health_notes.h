// The health of a job for users and programs: for each cause a sentence, its first location, and the command
// that renders this location again.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image/film/health.h"
#include "common/job/settings.h"

namespace ls {

struct HealthNote {
  HealthCause cause{};
  std::uint64_t count = 0;
  std::vector<HealthLocation> first;
  // For sequences: the first frame with this cause, to which `first` and `replay` refer.
  std::optional<std::uint32_t> frame;
  std::string replay;  // command that reproduces the first location; empty: there is no location
  bool operator==(const HealthNote&) const = default;
};

// Returns a note for each cause in `health`. `command` is replay_command() of the job.
std::vector<HealthNote> health_notes(const Health& health, const std::string& command);
// Adds `more`, the notes of frame number `frame`, to `notes`, those of the frames before it.
void add_notes(std::vector<HealthNote>& notes, std::span<const HealthNote> more, std::uint32_t frame);

// Returns {"clean", "nonfinite", "negative", "majorant_violations", "causes": [{"cause", "effect": "rejected"
// | "kept" | "input", "count", "text", "frame", "first": [{"pixel": [x, y], "sample"}], "replay"}]}.
std::string health_json(const Health& totals, std::span<const HealthNote> notes);

// Returns "lightshaft render SCENE" with all options that determine the value of a sample; each word is
// quoted for a shell. `scene` is the scene's name in the job. `frame` is the frame number, for jobs with
// frames.
std::string replay_command(const std::string& scene, const JobSpec& spec,
                           std::optional<std::uint32_t> frame = {});
// Returns the command for one sample of the pixel (x, y). `command` is from the function above.
std::string replay_command(const std::string& command, int x, int y, std::uint64_t sample);

}  // namespace ls
