#include "cli/farm/farm_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "cli/output/console.h"
#include "cli/output/convergence_text.h"
#include "cli/output/reply_fields.h"
#include "core/base/safe_text.h"
#include "core/image/exr/final_image.h"
#include "util/report/number_text.h"

namespace ls::cli {
namespace {

using nlohmann::json;
using Row = std::vector<std::string>;

std::string text(const json& object, const char* key) { return plain_text(text_field(object, key)); }

std::string number(const json& object, const char* key, const char* format) {
  const auto value = number_field(object, key);
  return value ? fmt::format(fmt::runtime(format), *value) : "-";
}

std::string time_of(const json& object, const char* key) {
  const auto value = number_field(object, key);
  return value ? show_seconds(*value) : "-";
}

std::string percent(const json& object, const char* key) {
  const auto value = number_field(object, key);
  return value ? fmt::format("{:.0f} %", 100 * *value) : "-";
}

// A sequence (a job with several frames) is listed completely if it has at most this many frames. In a longer
// list, frames that are done or queued are left out.
constexpr std::size_t kMostFrames = 100;

std::string frames_done(const json& frames) {
  std::string out = fmt::format("{} of {} done", int_field(frames, "done", 0), int_field(frames, "total", 0));
  for (const char* state : {"failed", "cancelled"})
    if (const int n = int_field(frames, state, 0); n > 0) out += fmt::format(", {} {}", n, state);
  return out;
}

std::string frames_table(const json& frames) {
  const std::vector<json> all = objects_field(frames, "list");
  std::vector<Row> rows{{"FRAME", "STATE", "DONE", "SPP", "RELMSE", "ERROR"}};
  for (const json& f : all) {
    const std::string state = text(f, "state");
    if (all.size() > kMostFrames && (state == "done" || state == "queued")) continue;
    rows.push_back({number(f, "frame", "{:.0f}"), state, percent(f, "progress"),
                    number(f, "spp_done", "{:.4g}"), number(f, "relmse", "{:.3g}"), text(f, "error")});
  }
  return rows.size() == 1 ? "" : "\n" + aligned(rows);
}

// Describes the samples done and requested. If the user gave a target error or a time but no number of
// samples, `spp` is only an upper limit.
std::string samples(const json& job) {
  const std::string done = number(job, "spp_done", "{:.6g}"), limit = number(job, "spp", "{:.0f}");
  const auto asked = job.find("spp_asked");
  if (asked == job.end() || !asked->is_null()) return done + " of " + limit;
  if (is_over(job)) return done;
  return fmt::format("{}, until {} (at most {})", done,
                     number_field(job, "target_error") ? "the target" : "its time is up",
                     report::count(number_field(job, "spp").value_or(NAN)));
}

void add_known(std::vector<Row>& rows, const char* name, const json& object, const char* key,
               const char* format = "{:.4g}") {
  if (number_field(object, key)) rows.push_back({name, number(object, key, format)});
}

void add_pixels(std::vector<Row>& rows, const char* name, const json& job, const char* key,
                const char* meaning) {
  if (const double n = number_field(job, key).value_or(0); n > 0)
    rows.push_back({name, fmt::format("{} pixels: {}", report::count(n), meaning)});
}

// Describes the most recent check of the denoised layers' error against the target.
std::string denoised_check_text(const json& check) {
  const auto at_most = number_field(check, "at_most");
  return fmt::format("{}, {} (with {} samples per pixel)", number(check, "relmse", "{:.3g}"),
                     at_most ? fmt::format("at most {:.3g}", *at_most) : "without an interval",
                     number(check, "spp", "{:.4g}"));
}

void add_error_rows(std::vector<Row>& rows, const json& job) {
  if (const std::string text = denoised_text(job); !text.empty()) rows.push_back({"denoised relMSE", text});
  rows.push_back({"relMSE", estimate_text(job, "relmse", "relmse_ci95")});
  const bool denoised = text_field(job, "target_layer") == "denoised";
  add_known(rows, denoised ? "target relMSE, denoised" : "target relMSE", job, "target_error", "{:g}");
  if (const json* check = object_field(job, "denoised_check"))
    rows.push_back({"relMSE, denoised", denoised_check_text(*check)});
  rows.push_back({"RMSE", estimate_text(job, "rmse", "rmse_ci95")});
  if (const json* reference = object_field(job, "reference")) {
    const auto add_reference_error = [&](const char* name, const char* key, const char* below) {
      const std::string text =
          reference_error_text(*reference, key, below, flag_field(job, "reference_same_seed"), 4);
      if (!text.empty()) rows.push_back({name, text});
    };
    add_reference_error("true relMSE", "relmse", "below_noise");
    add_reference_error("true RMSE", "rmse", "rmse_below_noise");
    add_known(rows, "FLIP", *reference, "flip");
  }
  add_pixels(rows, "too little light", job, "few_hits",
             "too few samples found light for their error to be known");
  add_pixels(rows, "not reached yet", job, "pixels_without_samples", "the error is of the others");
  const Verdict verdict = verdict_of(job);
  if (!verdict.words.empty()) rows.push_back({"verdict", verdict.words});
  if (!verdict.advice.empty()) rows.push_back({"what to do", verdict.advice});
  if (const auto slope = number_field(job, "slope")) {
    const auto ci = verdict_of(job).doubtful ? std::nullopt : pair_field(job, "slope_ci95");
    rows.push_back({"slope", ci ? fmt::format("{:.3g} ({:.3g} to {:.3g})", *slope, ci->first, ci->second)
                                : fmt::format("{:.3g}", *slope)});
  }
  add_known(rows, "efficiency", job, "efficiency_per_core", "{:.3g} (1 / (relMSE x core seconds))");
}

// Returns the numeric class of a worker or job: its first 12 digits, which `submit --numeric-class` accepts,
// and the platform in words.
std::string class_text(const json& of) {
  const std::string digits = text(of, "numeric_class").substr(0, 12), platform = text(of, "platform");
  return platform.empty() ? digits : digits + " " + platform;
}

std::string share_text(const json& share) {
  return fmt::format("{} of the farm: {} of {} workers, {} of {} threads", percent(share, "share"),
                     int_field(share, "workers", 0), int_field(share, "of_workers", 0),
                     int_field(share, "threads", 0), int_field(share, "of_threads", 0));
}

}  // namespace

bool is_over(const json& job) {
  const std::string state = text_field(job, "state");
  return state == "done" || state == "failed" || state == "cancelled";
}

std::string jobs_table(const json& answer) {
  std::vector<Row> rows{{"ID", "STATE", "DONE", "SPP", "RELMSE", "LEFT", "NAME"}};
  for (const json& job : objects_field(answer, "jobs")) {
    const json* frames = object_field(job, "frames");
    rows.push_back({text(job, "id"), text(job, "state"), percent(job, "progress"),
                    number(job, "spp_done", "{:.4g}"), number(job, "relmse", "{:.3g}"),
                    time_left_text(job, job, "eta_seconds"),
                    text(job, "name") + (flag_field(job, "fake") ? " (fake pixels)" : "") +
                        (unclean(job) ? " (numbers not clean)" : "") +
                        (verdict_of(job).doubtful ? " (don't trust its error yet)" : "") +
                        (text(job, "waits_for").empty() ? "" : " (waits for another job)") +
                        (frames ? fmt::format(" (frames: {})", frames_done(*frames)) : "")});
  }
  return rows.size() == 1 ? "no jobs" : aligned(rows);
}

std::string tokens_table(const json& answer) {
  std::vector<Row> rows{{"ID", "ROLE", "USER", ""}};
  for (const json& t : objects_field(answer, "tokens")) {
    rows.push_back(
        {text(t, "id"), text(t, "role"), text(t, "user"),
         flag_field(t, "of_file") ? text(t, "role") == "join" ? "DATA/join-token" : "DATA/token" : ""});
  }
  return aligned(rows);
}

std::string workers_table(const json& answer) {
  std::vector<Row> rows{
      {"NAME", "STATE", "THREADS", "UNITS", "CPU", "MEMORY", "SEEN", "CLASS", "JOB", "ACTIVITY"}};
  for (const json& w : objects_field(answer, "workers")) {
    const auto rss = w.find("rss_bytes");
    rows.push_back({text(w, "name"), text(w, "state") + (flag_field(w, "fake") ? " (fake)" : ""),
                    number(w, "threads", "{:.0f}"), number(w, "units_done", "{:.0f}"),
                    time_of(w, "cpu_seconds"),
                    rss != w.end() && rss->is_number_unsigned() ? show_bytes(rss->get<std::uint64_t>()) : "-",
                    time_of(w, "last_seen_seconds"), class_text(w), text(w, "job"), text(w, "activity")});
  }
  return rows.size() == 1 ? "no workers" : aligned(rows);
}

std::string job_text(const json& job) {
  std::vector<Row> rows{{"job", text(job, "id")}, {"name", text(job, "name")}, {"state", text(job, "state")}};
  if (const std::string stopped = text(job, "stopped"); !stopped.empty())
    rows.push_back({"stopped by", stopped});
  rows.push_back({"done", percent(job, "progress")});
  const json* frames = object_field(job, "frames");
  if (frames) rows.push_back({"frames", fmt::format("{}: {}", text(*frames, "range"), frames_done(*frames))});
  rows.push_back({"samples per pixel", samples(job)});
  add_error_rows(rows, job);
  rows.push_back({"time", time_of(job, "elapsed_seconds")});
  rows.push_back({"core time", time_of(job, "core_seconds")});
  rows.push_back({"left", time_left_text(job, job, "eta_seconds", "eta_ci95")});
  if (const json* more = object_field(job, "eta_with_more"))
    rows.push_back({fmt::format("with {} more workers", int_field(*more, "workers", 0)),
                    time_left_text(job, *more, "seconds", "ci95")});
  if (const std::string pinned = class_text(job); !pinned.empty()) rows.push_back({"numeric class", pinned});
  if (const json* share = object_field(job, "class_share"))
    rows.push_back({"can take it", share_text(*share)});
  const std::string error = text(job, "error"), waits = text(job, "waits_for");
  if (!waits.empty() && waits != error) rows.push_back({"waits", waits});
  if (!error.empty()) rows.push_back({"error", error});
  if (flag_field(job, "fake")) rows.push_back({"fake", kFakePixels});
  for (const std::string& warning : texts_field(job, "warnings"))
    rows.push_back({"warning", plain_text(warning)});
  if (job.contains("health")) rows.push_back({"numbers", unclean(job) ? "not clean" : "clean"});
  for (const std::string& line : health_lines(job)) rows.push_back({"", line});
  return aligned(rows) + (frames ? frames_table(*frames) : "");
}

}  // namespace ls::cli
