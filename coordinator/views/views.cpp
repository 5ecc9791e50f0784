#include "coordinator/views/views.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace ls::coordinator {
namespace {

using nlohmann::json;

json number(double value) { return std::isfinite(value) ? json(value) : json(); }
json pair_or_null(const std::optional<std::pair<double, double>>& v) {
  return v ? json{number(v->first), number(v->second)} : json();
}
json text_or_null(const std::string& text) { return text.empty() ? json() : json(text); }
// Writes `j` as text. Names in it come from users, so invalid UTF-8 is replaced.
std::string dump(const json& j) { return j.dump(-1, ' ', false, json::error_handler_t::replace); }

json to_value(const FramesView& v) {
  json j{{"range", to_string(v.range)}, {"total", v.total},   {"done", v.done},
         {"running", v.running},        {"failed", v.failed}, {"cancelled", v.cancelled},
         {"current", v.current}};
  if (v.all.empty()) return j;
  auto& list = j["list"] = json::array();
  for (const FrameView& f : v.all)
    list.push_back({{"frame", f.frame},
                    {"id", f.job.value},
                    {"state", to_string(f.state)},
                    {"progress", number(f.progress)},
                    {"spp_done", number(f.spp_done)},
                    {"relmse", f.relmse ? number(*f.relmse) : json()},
                    {"error", text_or_null(f.error)}});
  return j;
}

json to_value(const TimeSplit& t) {
  json j;
  for (const TimePart& part : kTimeParts) j[part.name] = number(t.*part.seconds);
  return j;
}

json to_value(const JobView& v) {
  json j{{"id", v.id.value},
         {"name", v.name},
         {"owner", v.owner},
         {"state", to_string(v.state)},
         {"stopped", text_or_null(v.stopped)},
         {"progress", number(v.progress)},
         {"spp", v.spp},
         {"spp_asked", v.spp_asked ? json(v.spp) : json()},
         {"spp_done", number(v.spp_done)},
         {"target_error", v.target_error ? number(*v.target_error) : json()},
         {"denoise", v.denoise},
         {"eta_seconds", v.eta_seconds ? number(*v.eta_seconds) : json()},
         {"eta_ci95", pair_or_null(v.eta_ci95)},
         {"eta_with_more", v.eta_with_more ? json{{"workers", kMoreWorkers},
                                                  {"seconds", number(*v.eta_with_more)},
                                                  {"ci95", pair_or_null(v.eta_with_more_ci95)}}
                                           : json()},
         // Older names of the same; they go with the next version.
         {"eta_with_8_more", v.eta_with_more ? number(*v.eta_with_more) : json()},
         {"eta_with_8_more_ci95", pair_or_null(v.eta_with_more_ci95)},
         {"error", text_or_null(v.error)},
         {"warnings", v.warnings},
         {"fake", v.fake},
         {"size", {v.size.width, v.size.height}},
         {"tile", v.tile},
         {"priority", v.priority},
         {"units_done", v.units_done},
         {"units_total", v.units_total},
         {"elapsed_seconds", number(v.elapsed_seconds)},
         {"core_seconds", number(v.core_seconds)},
         {"time", to_value(v.time)},
         {"submitted_unix", number(v.submitted_unix)},
         {"health", json::parse(health_json(v.health, v.notes))}};
  j["max_workers"] = v.max_workers ? json(*v.max_workers) : json();
  j["max_units"] = v.max_units ? json(*v.max_units) : json();
  j["memory_bytes"] = v.memory_bytes;
  const auto frame = frame_of(v.id);
  j["sequence"] = frame ? json(frame->sequence.value) : json();
  j["frame"] = frame ? json(frame->frame) : json();
  j["frames"] = v.frames ? to_value(*v.frames) : json();
  j["rmse"] = v.error_now ? number(v.error_now->rmse) : json();
  j["rmse_ci95"] = v.error_now && v.error_now->rmse_hi > 0
                       ? json{number(v.error_now->rmse_lo), number(v.error_now->rmse_hi)}
                       : json();
  j["relmse"] = v.error_now ? number(v.error_now->relmse) : json();
  j["relmse_ci95"] =
      v.error_now ? json{number(v.error_now->relmse_lo), number(v.error_now->relmse_hi)} : json();
  j["reference"] = v.reference_error
                       ? json{{"rmse", number(v.reference_error->rmse)},
                              {"relmse", number(v.reference_error->relmse)},
                              {"flip", v.reference_error->flip ? number(*v.reference_error->flip) : json()},
                              {"below_noise", v.reference_error->relmse_below_noise()},
                              {"rmse_below_noise", v.reference_error->rmse_below_noise()}}
                       : json();
  j["reference_same_seed"] = v.reference_same_seed;
  j["verdict"] = v.convergence_status ? json{{"kind", to_string(v.convergence_status->kind)},
                                             {"words", v.convergence_status->words},
                                             {"trusted", v.convergence_status->trusted}}
                                      : json();
  j["few_hits"] = v.few_hits ? json(*v.few_hits) : json();
  j["pixels_without_samples"] = v.pixels_without_samples ? json(*v.pixels_without_samples) : json();
  j["slope"] = v.trend ? number(-v.trend->slope) : json();
  j["slope_ci95"] = v.trend ? json{number(-v.trend->slope_hi), number(-v.trend->slope_lo)} : json();
  j["efficiency_per_core"] = v.efficiency ? number(*v.efficiency) : json();
  return j;
}

json to_value(const WorkerView& v) {
  return {{"id", v.id.value},
          {"name", v.name},
          {"build", v.build},
          {"numeric_class", v.numeric_class.hex()},
          {"fake", v.fake},
          {"threads", v.threads},
          {"tags", v.tags},
          {"state", v.state},
          {"activity", v.activity},
          {"job", text_or_null(v.job)},
          {"units_done", v.units_done},
          {"cpu_seconds", number(v.cpu_seconds)},
          {"rss_bytes", v.rss_bytes},
          {"memory_bytes", v.memory_bytes},
          {"last_seen_seconds", number(v.last_seen_seconds)}};
}

template <class View>
std::string listed(const char* key, const std::vector<View>& views) {
  json all = json::array();
  for (const auto& v : views) all.push_back(to_value(v));
  return dump(json{{key, std::move(all)}});
}

}  // namespace

std::string time_json(const TimeSplit& time) { return dump(to_value(time)); }
std::string job_json(const JobView& job) { return dump(to_value(job)); }
std::string jobs_json(const std::vector<JobView>& jobs) { return listed("jobs", jobs); }
std::string worker_json(const WorkerView& worker) { return dump(to_value(worker)); }
std::string workers_json(const std::vector<WorkerView>& workers) { return listed("workers", workers); }

std::string tiles_json(const std::vector<TileView>& tiles) {
  json all = json::array();
  for (const auto& t : tiles)
    all.push_back({{"tile", t.tile},
                   {"rect", {t.rect.x0, t.rect.y0, t.rect.x1, t.rect.y1}},
                   {"rounds", t.rounds_folded},
                   {"spp", t.spp},
                   {"relmse", t.relmse ? number(*t.relmse) : json()},
                   {"workers", t.workers}});
  return dump(json{{"tiles", std::move(all)}});
}

std::string convergence_csv(const std::vector<ConvergencePoint>& points) {
  std::string csv =
      "seconds,core_seconds,spp,rmse,relmse,relmse_lo,relmse_hi,true_rmse,true_relmse,true_flip,rmse_lo,rmse_"
      "hi\n";
  const auto or_nothing = [](const auto& reference_error, auto figure) {
    return reference_error ? fmt::format("{}", figure(*reference_error)) : std::string();
  };
  for (const auto& p : points)
    csv +=
        fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", p.seconds, p.core_seconds, p.spp, p.error.rmse,
                    p.error.relmse, p.error.relmse_lo, p.error.relmse_hi,
                    or_nothing(p.reference_error, [](const ReferenceError& t) { return t.rmse; }),
                    or_nothing(p.reference_error, [](const ReferenceError& t) { return t.relmse; }),
                    p.reference_error && p.reference_error->flip ? fmt::format("{}", *p.reference_error->flip)
                                                                 : std::string(),
                    p.error.rmse_lo, p.error.rmse_hi);
  return csv;
}

std::string tile_event_json(const JobId& job, TileIndex tile, const PixelRect& rect, std::string_view state,
                            std::uint64_t spp, std::string_view worker) {
  return dump(json{{"job", job.value},
                   {"tile", tile},
                   {"rect", {rect.x0, rect.y0, rect.x1, rect.y1}},
                   {"state", state},
                   {"spp", spp},
                   {"worker", worker}});
}

std::string worker_gone_json(const WorkerId& worker) {
  return dump(json{{"id", worker.value}, {"state", "gone"}});
}

std::string job_moved_json(const JobId& job) { return dump(json{{"id", job.value}, {"state", "moved"}}); }
std::string job_removed_json(const JobId& job) { return dump(json{{"id", job.value}, {"state", "removed"}}); }

}  // namespace ls::coordinator
