#include "coordinator/views/views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/parse_number.h"
#include "core/job/advice.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

json number(double value) { return std::isfinite(value) ? json(value) : json(); }
json number(const std::optional<double>& value) { return value ? number(*value) : json(); }
json interval(double from, double to) { return {number(from), number(to)}; }
json interval(const std::optional<std::pair<double, double>>& v) {
  return v ? interval(v->first, v->second) : json();
}
json text_or_null(const std::string& text) { return text.empty() ? json() : json(text); }
json rectangle(const PixelRect& r) { return {r.x0, r.y0, r.x1, r.y1}; }
template <class T>
json or_null(const std::optional<T>& value) {
  return value ? json(*value) : json();
}
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
                    {"relmse", number(f.relmse)},
                    {"error", text_or_null(f.error)}});
  return j;
}

json to_value(const TimeSplit& t) {
  json j;
  for (const TimePart& part : kTimeParts) j[part.name] = number(t.*part.seconds);
  return j;
}

json to_value(const DenoisedCheck& c) {
  return {
      {"spp", number(c.spp)}, {"relmse", number(std::max(0.0, c.relmse))}, {"at_most", number(c.at_most)}};
}

// In the result, "share" is null if no workers are connected.
json to_value(const ClassShare& s) {
  return {{"workers", s.workers},
          {"of_workers", s.of_workers},
          {"threads", s.threads},
          {"of_threads", s.of_threads},
          {"share", s.of_threads > 0 ? json(static_cast<double>(s.threads) / s.of_threads) : json()}};
}

json to_value(const ReferenceError& e) {
  return {{"rmse", number(e.rmse)},
          {"relmse", number(e.relmse)},
          {"flip", number(e.flip)},
          {"below_noise", e.relmse_below_noise()},
          {"rmse_below_noise", e.rmse_below_noise()}};
}

json to_value(const std::vector<AfterView>& after) {
  json all = json::array();
  for (const AfterView& one : after)
    all.push_back({{"id", one.id.value}, {"state", one.state ? json(to_string(*one.state)) : json()}});
  return all;
}

json to_value(const JobFailure& f) {
  json attempts = json::array();
  for (const JobFailure::Attempt& a : f.attempts)
    attempts.push_back({{"worker", a.worker},
                        {"reason", text_or_null(a.reason)},
                        {"signal", or_null(a.signal)},
                        {"pixel", a.pixel ? json{a.pixel->first, a.pixel->second} : json()},
                        {"sample", or_null(a.sample)}});
  return {{"kind", to_string(f.kind)},
          {"tile", f.tile},
          {"rect", rectangle(f.rect)},
          {"round", f.round},
          {"samples", {f.samples.s0, f.samples.s1}},
          {"frame", or_null(f.frame)},
          {"attempts", std::move(attempts)},
          {"replay", text_or_null(f.replay)}};
}

std::string advice_of(const JobView& v) {
  // In a sequence that is running, frames that wait do not hold up the others
  const bool goes_on = v.state == JobState::running ? v.after.empty() || v.frames
                                                    : v.state == JobState::queued && v.after.empty();
  return advice_on(*v.convergence_status, {.job = v.id.value,
                                           .relmse = v.error_now ? v.error_now->relmse : 0,
                                           .lit = v.lit,
                                           .spp_done = v.spp_done,
                                           .goes_on = goes_on,
                                           .can_extend = v.state == JobState::done});
}

json to_value(const JobView& v) {
  const auto frame = frame_of(v.id);
  const ErrorFigures* error = v.error_now ? &*v.error_now : nullptr;
  return {{"id", v.id.value},
          {"name", v.name},
          {"owner", v.owner},
          {"state", to_string(v.state)},
          {"stopped", text_or_null(v.stopped)},
          {"progress", number(v.progress)},
          {"spp", v.spp},
          {"spp_asked", v.spp_asked ? json(v.spp) : json()},
          {"spp_done", number(v.spp_done)},
          {"target_error", number(v.target_error)},
          {"target_layer", v.target_error ? json(to_string(v.target_layer)) : json()},
          {"denoised_check", v.denoised_check ? to_value(*v.denoised_check) : json()},
          {"denoise", v.denoise},
          {"denoised", v.denoised ? json{{"relmse", number(v.denoised->relmse)},
                                         {"relmse_ci95", interval(v.denoised->relmse_ci95)}}
                                  : json()},
          {"eta_seconds", number(v.eta_seconds)},
          {"eta_ci95", interval(v.eta_ci95)},
          {"eta_with_more", v.eta_with_more ? json{{"workers", kMoreWorkers},
                                                   {"seconds", number(*v.eta_with_more)},
                                                   {"ci95", interval(v.eta_with_more_ci95)}}
                                            : json()},
          // The same values under their earlier names, for clients of earlier versions.
          {"eta_with_8_more", number(v.eta_with_more)},
          {"eta_with_8_more_ci95", interval(v.eta_with_more_ci95)},
          {"error", text_or_null(v.error)},
          {"failure", v.failure ? to_value(*v.failure) : json()},
          {"after", to_value(v.after)},
          {"waits_for", text_or_null(v.waits_for)},
          {"warnings", v.warnings},
          {"fake", v.fake},
          {"size", {v.size.width, v.size.height}},
          {"tile", v.tile},
          {"priority", v.priority},
          {"focus", v.focus ? rectangle(*v.focus) : json()},
          {"max_workers", or_null(v.max_workers)},
          {"max_units", or_null(v.max_units)},
          {"memory_bytes", v.memory_bytes},
          {"units_done", v.units_done},
          {"units_total", v.units_total},
          {"elapsed_seconds", number(v.elapsed_seconds)},
          {"core_seconds", number(v.core_seconds)},
          {"queued_core_seconds", number(v.queued_core_seconds)},
          {"time", to_value(v.time)},
          {"submitted_unix", number(v.submitted_unix)},
          {"health", json::parse(health_json(v.health, v.notes))},
          {"numeric_class", v.numeric_class ? json(v.numeric_class->hex()) : json()},
          {"platform", text_or_null(v.platform)},
          {"class_share", v.class_share ? to_value(*v.class_share) : json()},
          {"sequence", frame ? json(frame->sequence.value) : json()},
          {"frame", frame ? json(frame->frame) : json()},
          {"frames", v.frames ? to_value(*v.frames) : json()},
          {"rmse", error ? number(error->rmse) : json()},
          {"rmse_ci95", error && error->rmse_hi > 0 ? interval(error->rmse_lo, error->rmse_hi) : json()},
          {"relmse", error ? number(error->relmse) : json()},
          {"relmse_ci95", error ? interval(error->relmse_lo, error->relmse_hi) : json()},
          {"reference", v.reference_error ? to_value(*v.reference_error) : json()},
          {"reference_same_seed", v.reference_same_seed},
          {"verdict", v.convergence_status ? json{{"kind", to_string(v.convergence_status->kind)},
                                                  {"words", v.convergence_status->words},
                                                  {"trusted", v.convergence_status->trusted},
                                                  {"advice", text_or_null(advice_of(v))}}
                                           : json()},
          {"few_hits", or_null(v.few_hits)},
          {"pixels_without_samples", or_null(v.pixels_without_samples)},
          {"slope", v.trend ? number(-v.trend->slope) : json()},
          {"slope_ci95", v.trend ? interval(-v.trend->slope_hi, -v.trend->slope_lo) : json()},
          {"efficiency_per_core", number(v.efficiency)}};
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
std::string workers_json(const std::vector<WorkerView>& workers) {
  json all = json::array();
  for (const WorkerView& worker : workers) all.push_back(to_value(worker));
  return dump(json{{"workers", std::move(all)}});
}

std::string video_json(const VideoView& v) {
  static constexpr const char* kStates[] = {"none", "waiting", "making", "ready", "failed"};
  const bool asked = v.state != VideoState::none;
  return dump(json{{"state", kStates[static_cast<int>(v.state)]},
                   {"fps", asked ? number(v.asked.fps) : json()},
                   {"exposure", asked ? number(v.asked.exposure) : json()},
                   {"layer", asked ? json(v.asked.denoised ? "denoised" : "rgb") : json()},
                   {"frames", v.frames},
                   {"frames_done", v.frames_done},
                   {"bytes", v.state == VideoState::ready ? json(v.bytes) : json()},
                   {"error", text_or_null(v.error)}});
}

std::string tiles_json(const std::vector<TileView>& tiles) {
  json all = json::array();
  for (const auto& t : tiles)
    all.push_back({{"tile", t.tile},
                   {"rect", rectangle(t.rect)},
                   {"rounds", t.rounds_folded},
                   {"spp", t.spp},
                   {"relmse", number(t.relmse)},
                   {"workers", t.workers}});
  return dump(json{{"tiles", std::move(all)}});
}

std::string convergence_csv(const std::vector<ConvergencePoint>& points) {
  std::string csv =
      "seconds,core_seconds,spp,rmse,relmse,relmse_lo,relmse_hi,true_rmse,true_relmse,true_flip,rmse_lo,rmse_"
      "hi\n";
  for (const auto& p : points) {
    const auto& r = p.reference_error;
    csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", p.seconds, p.core_seconds, p.spp,
                       p.error.rmse, p.error.relmse, p.error.relmse_lo, p.error.relmse_hi,
                       r ? fmt::to_string(r->rmse) : "", r ? fmt::to_string(r->relmse) : "",
                       r && r->flip ? fmt::to_string(*r->flip) : "", p.error.rmse_lo, p.error.rmse_hi);
  }
  return csv;
}

std::string tile_event_json(const JobId& job, TileIndex tile, const PixelRect& rect, std::string_view state,
                            std::uint64_t spp, std::string_view worker) {
  return dump(json{{"job", job.value},
                   {"tile", tile},
                   {"rect", rectangle(rect)},
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

// Only the ids of frames contain this: other ids consist of "j-" and hexadecimal digits
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
  // Accepts only ids that frame_job() makes: an id that ends in "-frame07" is not a frame's, since
  // frame_job() writes no leading zeros.
  return frame_job(id.sequence, id.frame) == job ? std::optional(id) : std::nullopt;
}

}  // namespace ls::coordinator
