#include "common/job/health_notes.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

#include "common/base/safe_text.h"

namespace ls {

namespace {

using nlohmann::json;

const char* word(HealthEffect effect) {
  if (effect == HealthEffect::rejected) return "rejected";
  return effect == HealthEffect::kept ? "kept" : "input";
}

}  // namespace

std::vector<HealthNote> health_notes(const Health& health, const std::string& command) {
  std::vector<HealthNote> notes;
  for (const auto& [cause, entry] : health.causes) {
    notes.push_back({cause, entry.count, entry.first, {}, {}});
    if (entry.first.empty()) continue;
    const HealthLocation& s = entry.first.front();
    notes.back().replay = replay_command(command, s.x, s.y, s.sample);
  }
  return notes;
}

void add_notes(std::vector<HealthNote>& notes, std::span<const HealthNote> more, std::uint32_t frame) {
  for (const HealthNote& note : more) {
    const auto same = [&](const HealthNote& n) { return n.cause == note.cause; };
    if (const auto known = std::find_if(notes.begin(), notes.end(), same); known != notes.end()) {
      known->count += note.count;
    } else {
      notes.push_back(note);
      notes.back().frame = frame;
    }
  }
  std::sort(notes.begin(), notes.end(), [](const auto& a, const auto& b) { return a.cause < b.cause; });
}

std::string health_json(const Health& totals, std::span<const HealthNote> notes) {
  json causes = json::array();
  for (const HealthNote& n : notes) {
    json first = json::array();
    for (const HealthLocation& s : n.first) first.push_back({{"pixel", {s.x, s.y}}, {"sample", s.sample}});
    causes.push_back({{"cause", to_string(n.cause)},
                      {"effect", word(effect_of(n.cause))},
                      {"count", n.count},
                      {"text", sentence(n.cause, n.count)},
                      {"frame", n.frame ? json(*n.frame) : json()},
                      {"first", std::move(first)},
                      {"replay", n.replay.empty() ? json() : json(n.replay)}});
  }
  const json j{{"clean", notes.empty()},
               {"nonfinite", totals.nonfinite},
               {"negative", totals.negative},
               {"majorant_violations", totals.majorant_violations},
               {"causes", std::move(causes)}};
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

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
