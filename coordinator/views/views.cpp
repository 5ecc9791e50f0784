#include "coordinator/views/views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/parse_number.h"
#include "coordinator/views/job_view.h"

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

json to_value(const DenoisedCheck& c) {
  return {{"spp", number(c.spp)},
          {"relmse", number(std::max(0.0, c.relmse))},
          {"at_most", c.at_most ? number(*c.at_most) : json()}};
}

// The value "share" is null if no workers are connected.
json to_value(const ClassShare& s) {
  return {{"workers", s.workers},
          {"of_workers", s.of_workers},
          {"threads", s.threads},
          {"of_threads", s.of_threads},
          {"share", s.of_threads > 0 ? json(static_cast<double>(s.threads) / s.of_threads) : json()}};
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
         {"target_layer", v.target_error ? json(to_string(v.target_layer)) : json()},
         {"denoised_check", v.denoised_check ? to_value(*v.denoised_check) : json()},
         {"denoise", v.denoise},
         {"eta_seconds", v.eta_seconds ? number(*v.eta_seconds) : json()},
         {"eta_ci95", pair_or_null(v.eta_ci95)},
         {"eta_with_more", v.eta_with_more ? json{{"workers", kMoreWorkers},
                                                  {"seconds", number(*v.eta_with_more)},
                                                  {"ci95", pair_or_null(v.eta_with_more_ci95)}}
                                           : json()},
         // Older names of the same values, for clients of earlier versions.
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
         {"queued_core_seconds", number(v.queued_core_seconds)},
         {"time", to_value(v.time)},
         {"submitted_unix", number(v.submitted_unix)},
         {"health", json::parse(health_json(v.health, v.notes))}};
  j["focus"] = v.focus ? json{v.focus->x0, v.focus->y0, v.focus->x1, v.focus->y1} : json();
  j["max_workers"] = v.max_workers ? json(*v.max_workers) : json();
  j["max_units"] = v.max_units ? json(*v.max_units) : json();
  j["memory_bytes"] = v.memory_bytes;
  j["numeric_class"] = v.numeric_class ? json(v.numeric_class->hex()) : json();
  j["platform"] = text_or_null(v.platform);
  j["class_share"] = v.class_share ? to_value(*v.class_share) : json();
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
          {"platform", text_or_null(v.platform)},
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
std::string jobs_json(const JobsPage& page) {
  json jobs = json::array(), states = json::object();
  for (const JobView& job : page.jobs) jobs.push_back(to_value(job));
  for (std::size_t i = 0; i < page.states.size(); ++i)
    states[std::string(to_string(static_cast<JobState>(i)))] = page.states[i];
  return dump(json{{"jobs", std::move(jobs)},
                   {"total", page.total},
                   {"states", std::move(states)},
                   {"owners", page.owners}});
}
std::string worker_json(const WorkerView& worker) { return dump(to_value(worker)); }
std::string workers_json(const std::vector<WorkerView>& workers) { return listed("workers", workers); }

std::string video_json(const VideoView& v) {
  static constexpr const char* kStates[] = {"none", "waiting", "making", "ready", "failed"};
  const bool asked = v.state != VideoState::none;
  return json{{"state", kStates[static_cast<int>(v.state)]},
              {"fps", asked ? number(v.asked.fps) : json()},
              {"exposure", asked ? number(v.asked.exposure) : json()},
              {"layer", asked ? json(v.asked.denoised ? "denoised" : "rgb") : json()},
              {"frames", v.frames},
              {"frames_done", v.frames_done},
              {"bytes", v.state == VideoState::ready ? json(v.bytes) : json()},
              {"error", text_or_null(v.error)}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

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

namespace {

// No other id can contain this: ids consist of "j-" and hexadecimal digits
constexpr std::string_view kMark = "-frame";

}  // namespace

JobId frame_job(const JobId& sequence, std::uint32_t frame) {
  return {fmt::format("{}{}{}", sequence.value, kMark, frame)};
}

std::optional<FrameId> frame_of(const JobId& job) {
  const std::size_t at = job.value.rfind(kMark);
  if (at == 0 || at == std::string::npos) return std::nullopt;
  const auto number = parse_number<std::uint32_t>(std::string_view(job.value).substr(at + kMark.size()));
  if (!number || *number > kMaxFrameNumber) return std::nullopt;
  const FrameId id{{job.value.substr(0, at)}, *number};
  // Only the exact form that frame_job() makes is accepted: "-frame07" is not a frame.
  return frame_job(id.sequence, id.frame) == job ? std::optional(id) : std::nullopt;
}

}  // namespace ls::coordinator
