// Describes the numeric health of a job (image/film/health.h) to users and programs. A note has, for each
// cause of bad samples, a sentence, the first locations (pixel and sample), and a command that renders the
// first location again.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/image/film/health.h"
#include "core/job/settings.h"

namespace ls {

struct HealthNote {
  HealthCause cause{};
  std::uint64_t count = 0;
  std::vector<HealthLocation> first;
  // The first frame in which this cause occurred; `first` and `replay` belong to that frame. nullopt: the job
  // is not a sequence of frames.
  std::optional<std::uint32_t> frame;
  std::string replay;  // command that renders the first location again; empty: there is no location
  bool operator==(const HealthNote&) const = default;
};

// Returns a note for each cause in `health`. `command` is replay_command() of the job.
std::vector<HealthNote> health_notes(const Health& health, const std::string& command);
// Merges the notes of a further frame of a sequence into `notes`, which are the notes of the frames before
// it. `more` are the notes of that frame, `frame` is its number.
void add_notes(std::vector<HealthNote>& notes, std::span<const HealthNote> more, std::uint32_t frame);

// Returns the JSON text {"clean", "nonfinite", "negative", "majorant_violations", "causes": [{"cause",
// "effect": "rejected" | "kept" | "input", "count", "text", "frame", "first": [{"pixel": [x, y], "sample"}],
// "replay"}]}.
std::string health_json(const Health& totals, std::span<const HealthNote> notes);

// Returns "lightshaft render SCENE" with all options that determine the value of a sample; each word is
// quoted for a shell. `scene` is the scene's name in the job. `frame` is the frame number, for jobs with
// frames.
std::string replay_command(const std::string& scene, const JobSpec& spec,
                           std::optional<std::uint32_t> frame = {});
// Returns the command that renders one sample of the pixel (x, y). `command` is the result of
// replay_command() above for the job.
std::string replay_command(const std::string& command, int x, int y, std::uint64_t sample);

}  // namespace ls
