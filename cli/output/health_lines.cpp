#include "cli/output/health_lines.h"

#include <fmt/format.h>

#include "cli/output/console.h"
#include "cli/output/reply_fields.h"
#include "common/base/plain_text.h"

namespace ls::cli {
namespace {

using nlohmann::json;

constexpr std::size_t kMostCauses = 64;  // limit for a farm's answer

const json* causes_of(const json& job) {
  const auto health = job.find("health");
  if (health == job.end() || !health->is_object()) return nullptr;
  const auto causes = health->find("causes");
  return causes != health->end() && causes->is_array() ? &*causes : nullptr;
}

// Returns "; first at pixel 3,4 sample 7"; empty for a cause without a location.
std::string place_of(const json& cause) {
  const auto first = cause.find("first");
  if (first == cause.end() || !first->is_array() || first->empty() || !(*first)[0].is_object()) return "";
  const json& spot = (*first)[0];
  const auto pixel = pair_field(spot, "pixel");
  const auto sample = number_field(spot, "sample");
  if (!pixel || !sample) return "";
  const auto frame = number_field(cause, "frame");
  return fmt::format("; first {}at pixel {:.0f},{:.0f} sample {:.0f}",
                     frame ? fmt::format("in frame {:.0f} ", *frame) : "", pixel->first, pixel->second,
                     *sample);
}

}  // namespace

std::vector<std::string> health_lines(const json& job) {
  std::vector<std::string> lines;
  const json* causes = causes_of(job);
  if (!causes) return lines;
  for (const json& cause : *causes) {
    if (!cause.is_object() || lines.size() >= 2 * kMostCauses) continue;
    lines.push_back(plain_text(text_field(cause, "text")) + place_of(cause));
    if (const std::string replay = text_field(cause, "replay"); !replay.empty())
      lines.push_back("  see it again: " + plain_text(replay));
  }
  return lines;
}

bool unclean(const json& job) {
  const json* causes = causes_of(job);
  return causes && !causes->empty();
}

void print_health(const json& job) {
  const auto lines = health_lines(job);
  if (lines.empty()) return;
  print_note("the numbers of this image are not clean:");
  for (const std::string& line : lines) print_note("  " + line);
}

}  // namespace ls::cli
