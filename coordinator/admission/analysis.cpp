#include "coordinator/admission/analysis.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "common/scene/schema/integrators.h"

namespace ls::coordinator {
namespace {

// Pruned items that are listed: further ones are much like these, and records stay small
constexpr std::size_t kMostListed = 64;

// Returns the bytes of the files that only this part of the renderer reads.
std::uint64_t bytes_of_files(const scene::Needs& needs, const std::string& part) {
  static const std::map<std::string, std::string> kReads = {{"meshes", "mesh"},
                                                            {"bitmap textures", "texture"},
                                                            {"environment map", "environment map"},
                                                            {"volume grids", "grid"}};
  const auto reads = kReads.find(part);
  if (reads == kReads.end()) return 0;
  std::uint64_t sum = 0;
  for (const scene::FileNeed& f : needs.files) {
    const auto used_so = [&](const std::string& use) { return use.starts_with(reads->second); };
    if (std::any_of(f.uses.begin(), f.uses.end(), used_so)) sum += f.bytes;
  }
  return sum;
}

}  // namespace

void note_analysis(const scene::Pruned& pruned, const RenderSettings& settings, StoredJob& job) {
  using nlohmann::json;
  const scene::Needs needs = scene::needs_of(pruned.scene, scene::sees_media(settings.integrator));
  job.needs = canonical_json(needs);
  json parts = json::array(), left_out = json::array();
  for (const scene::Need& part : in_words(needs)) {
    (part.used ? job.features_used : job.features_left_out).push_back(part.part);
    parts.push_back({{"part", part.part},
                     {"used", part.used},
                     {"why", part.why},
                     {"bytes", bytes_of_files(needs, part.part)}});
  }
  for (const scene::LeftOut& x : pruned.left_out) {
    if (left_out.size() == kMostListed) break;
    left_out.push_back({{"what", x.what}, {"why", x.why}, {"count", x.count}, {"bytes", x.bytes}});
  }
  job.analysis = json{{"parts", std::move(parts)}, {"left_out", std::move(left_out)}}.dump(
      -1, ' ', false, json::error_handler_t::replace);
}

}  // namespace ls::coordinator
