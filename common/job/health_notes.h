// The health of a job for users and programs: for each cause a sentence, its first location, and the command
// that renders this location again.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image/film/health.h"

namespace ls {

struct HealthNote {
  HealthCause cause{};
  std::uint64_t count = 0;
  std::vector<HealthLocation> first;
  std::optional<std::uint32_t>
      frame;           // for sequences: the first frame with this cause, to which `first` and `replay` refer
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

}  // namespace ls
