#include "core/job/health_notes.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

#include "core/base/safe_text.h"
#include "core/job/describe.h"
#include "core/job/objects.h"

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
  job::for_each_setting(spec, [&]<class T>(const job::Setting& s, const T& value) {
    const std::string_view option = s.option.substr(0, s.option.find(','));
    if (s.name == "frames" && frame) command += fmt::format(" {} {}", option, *frame);
    if (!s.pixels || value == T{}) return;
    const auto add = [&](const std::string& text) {
      // A value that begins like an option must not be a word of its own.
      const std::string_view between = !text.starts_with('-') ? " " : option.starts_with("--") ? "=" : "";
      command += fmt::format(" {}{}{}", option, between, shell_word(text));
    };
    if constexpr (std::is_same_v<T, job::Defines>) {
      for (const auto& [name, one] : value) add(name + "=" + one);
    } else {
      job::with_value(value, [&](const auto& one) { add(job::text_of(one)); });
    }
  });
  return command;
}

std::string replay_command(const std::string& command, int x, int y, std::uint64_t sample) {
  return fmt::format("{} --pixel {},{} --sample {}", command, x, y, sample);
}

}  // namespace ls
