// What clients see of a sequence (a job with frames) as a whole.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "coordinator/service/sequence.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/views/views.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

FrameRange range_of(const StoredJob& first, const StoredJob& last) {
  if (first.spec.frames) return *first.spec.frames;
  if (last.spec.frames) return *last.spec.frames;
  return {frame_of(first.id)->frame, frame_of(last.id)->frame, 1};  // both records are damaged
}

}  // namespace

JobView Service::sequence_view_locked(const JobId& id, const Sequence& sequence, bool with_frames) const {
  std::vector<JobView> views;
  views.reserve(sequence.frames.size());
  bool open = false;
  double began = 0, ended = 0;
  for (const EntryPtr& frame : sequence.frames) {
    views.push_back(view_locked(*frame));
    const JobState state = views.back().state;
    open |= state == JobState::queued || state == JobState::running || state == JobState::paused;
    const JobTotals& totals = frame->stored.totals;
    if (totals.began_unix > 0) began = began > 0 ? std::min(began, totals.began_unix) : totals.began_unix;
    ended = std::max(ended, totals.ended_unix);
  }
  SequenceFacts facts;
  facts.id = id;
  facts.range = range_of(sequence.frames.front()->stored, sequence.frames.back()->stored);
  facts.warnings = sequence.warnings;
  facts.cores = farm_.cores_connected();
  facts.workers = farm_.workers_connected();
  if (began > 0) facts.elapsed_seconds = std::max(0.0, (open || ended == 0 ? unix_now() : ended) - began);
  JobView view = sequence_view(facts, views);
  if (with_frames)
    for (const JobView& v : views) view.frames->all.push_back(frame_view(v));
  return view;
}

// Returns the report of a sequence as JSON: values of every frame, and of all together. Frames without
// results have no pixel digest.
Result<std::string> Service::sequence_report(const JobId& id) const {
  JobView view;
  {
    const std::lock_guard lock(mutex_);
    const auto found = sequences_.find(id);
    if (found == sequences_.end()) return fail(Errc::not_found, fmt::format("there is no job {}", id.value));
    view = sequence_view_locked(id, found->second, true);
  }
  static constexpr const char* kKept[] = {"seed",
                                          "scene",
                                          "spp",
                                          "samples",
                                          "load_seconds",
                                          "render_seconds",
                                          "core_seconds",
                                          "time",
                                          "peak_rss_bytes",
                                          "rmse",
                                          "rmse_ci95",
                                          "relmse",
                                          "relmse_ci95",
                                          "verdict",
                                          "verdict_kind",
                                          "trusted",
                                          "few_hits_pixels",
                                          "slope",
                                          "forecast",
                                          "efficiency",
                                          "efficiency_per_core",
                                          "nonfinite_samples",
                                          "health",
                                          "pixels_sha256",
                                          "numeric_class",
                                          "fake",
                                          "stopped"};
  json frames = json::array();
  std::uint64_t samples = 0, rss = 0;
  double load = 0;
  bool all_done = true;
  Sha256 chain;
  json last;
  for (const FrameView& f : view.frames->all) {
    json row{{"frame", f.frame}, {"job", f.job.value}, {"state", to_string(f.state)}};
    all_done &= f.state == JobState::done;
    const auto text = f.spp_done > 0 ? report_json(f.job) : fail(Errc::not_found, "nothing came of it yet");
    const json report = text ? json::parse(*text, nullptr, false) : json();
    if (report.is_object()) {
      for (const char* key : kKept) row[key] = report.value(key, json());
      samples += report.value("samples", std::uint64_t{0});
      rss = std::max(rss, report.value("peak_rss_bytes", std::uint64_t{0}));
      load += report.value("load_seconds", 0.0);
      const auto pixels = Digest::parse(report.value("pixels_sha256", ""));
      if (pixels) chain.update(std::as_bytes(std::span(pixels->bytes)));
      all_done &= pixels.has_value();
      last = report;
    }
    frames.push_back(std::move(row));
  }
  const auto number = [](double x) { return std::isfinite(x) ? json(x) : json(); };
  json j{{"job", id.value},
         {"state", to_string(view.state)},
         {"size", {view.size.width, view.size.height}},
         {"spp", number(view.spp_done)},
         {"samples", samples},
         {"load_seconds", load},
         {"render_seconds", number(view.elapsed_seconds)},
         {"core_seconds", number(view.core_seconds)},
         {"time", json::parse(time_json(view.time))},
         {"peak_rss_bytes", rss},
         {"nonfinite_samples", view.health.nonfinite},
         {"negative_samples", view.health.negative},
         {"majorant_violations", view.health.majorant_violations},
         {"health", json::parse(health_json(view.health, view.notes))},
         {"pixels_sha256", all_done ? json(chain.finish().hex()) : json()},
         {"features_used", last.is_object() ? last.value("features_used", json()) : json::array()},
         {"features_left_out", last.is_object() ? last.value("features_left_out", json()) : json::array()},
         {"numeric_class", last.is_object() ? last.value("numeric_class", json()) : json()},
         {"stopped", view.stopped.empty() ? json() : json(view.stopped)},
         {"warnings", view.warnings},
         {"fake", view.fake},
         {"convergence", json::array()},  // every frame has its own
         {"frames", std::move(frames)}};
  const auto& e = view.error_now;
  j["rmse"] = e ? number(e->rmse) : json();
  j["relmse"] = e ? number(e->relmse) : json();
  j["relmse_ci95"] = e ? json{number(e->relmse_lo), number(e->relmse_hi)} : json();
  j["trusted"] = view.convergence_status && view.convergence_status->trusted;
  j["verdict"] = view.convergence_status ? json(view.convergence_status->words) : json();
  j["verdict_kind"] = view.convergence_status ? json(to_string(view.convergence_status->kind)) : json();
  j["few_hits_pixels"] = view.few_hits ? json(*view.few_hits) : json();
  return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

// Returns the log lines of all frames, by time. If there are more than kLogLinesKept, the oldest are left
// out.
Result<std::string> Service::sequence_log(const JobId& id) const {
  std::vector<std::pair<JobId, std::uint32_t>> frames;
  {
    const std::lock_guard lock(mutex_);
    const auto found = sequences_.find(id);
    if (found == sequences_.end()) return fail(Errc::not_found, fmt::format("there is no job {}", id.value));
    for (const EntryPtr& frame : found->second.frames)
      frames.emplace_back(frame->stored.id, frame_of(frame->stored.id)->frame);
  }
  std::vector<LogLine> all;
  const auto shorten = [&](std::size_t most) {
    std::stable_sort(all.begin(), all.end(),
                     [](const LogLine& a, const LogLine& b) { return a.unix_time < b.unix_time; });
    if (all.size() > most) all.erase(all.begin(), all.end() - static_cast<std::ptrdiff_t>(most));
  };
  for (const auto& [job, frame] : frames) {
    auto lines = store_->log(job);
    if (!lines) return tl::unexpected(lines.error());
    for (LogLine& line : *lines)
      all.push_back({line.unix_time, fmt::format("frame {}: {}", frame, line.text)});
    if (all.size() > 4 * limits::kLogLinesKept) shorten(limits::kLogLinesKept);
  }
  shorten(limits::kLogLinesKept);
  return log_text(all);
}

std::string log_text(const std::vector<LogLine>& lines) {
  std::string text;
  for (const LogLine& line : lines)
    text += fmt::format("{:%Y-%m-%dT%H:%M:%SZ} {}\n", fmt::gmtime(static_cast<std::time_t>(line.unix_time)),
                        line.text);
  return text;
}

}  // namespace ls::coordinator
