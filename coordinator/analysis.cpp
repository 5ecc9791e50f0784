#include "coordinator/analysis.h"

#include <nlohmann/json.hpp>

#include "common/scene/integrators.h"

namespace ls::coordinator {
namespace {

constexpr std::size_t kMostListed = 64;  // of what was pruned: more are of one kind, and a record stays small

}  // namespace

void note_analysis(const scene::Pruned& pruned, const RenderSettings& settings, StoredJob& job) {
  using nlohmann::json;
  const scene::Needs needs = scene::needs_of(pruned.scene, scene::sees_media(settings.integrator));
  job.needs = canonical_json(needs);
  json parts = json::array(), left_out = json::array();
  for (const scene::Need& part : in_words(needs)) {
    (part.used ? job.features_used : job.features_left_out).push_back(part.part);
    parts.push_back({{"part", part.part}, {"used", part.used}, {"why", part.why}});
  }
  for (const scene::LeftOut& x : pruned.left_out) {
    if (left_out.size() == kMostListed) break;
    left_out.push_back({{"what", x.what}, {"why", x.why}, {"count", x.count}, {"bytes", x.bytes}});
  }
  job.analysis = json{{"parts", std::move(parts)}, {"left_out", std::move(left_out)}}.dump(
      -1, ' ', false, json::error_handler_t::replace);
}

}  // namespace ls::coordinator
