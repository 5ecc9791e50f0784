// The health of a job as people and programs are told of it: a sentence for each cause, where it was first,
// and the command that shows it again.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image/health.h"

namespace ls {

struct HealthNote {
  HealthCause cause{};
  std::uint64_t count = 0;
  std::vector<HealthSpot> first;
  std::optional<std::uint32_t>
      frame;           // of a sequence: the first that has it, which `first` and `replay` are of
  std::string replay;  // of the first place; empty: there is none
  bool operator==(const HealthNote&) const = default;
};

// `command`: replay_command() of the job.
std::vector<HealthNote> health_notes(const Health& health, const std::string& command);
// Those of another frame to those of the frames before it.
void add_notes(std::vector<HealthNote>& notes, std::span<const HealthNote> more, std::uint32_t frame);

// {"clean", "nonfinite", "negative", "majorant_violations", "causes": [{"cause", "effect": "rejected" |
// "kept" | "input", "count", "text", "frame", "first": [{"pixel": [x, y], "sample"}], "replay"}]}
std::string health_json(const Health& totals, std::span<const HealthNote> notes);

}  // namespace ls
