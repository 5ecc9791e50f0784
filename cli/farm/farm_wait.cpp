#include "cli/farm/farm_wait.h"

#include <fmt/format.h>
#include <poll.h>

#include "cli/farm/farm_tables.h"
#include "cli/farm/http_client.h"
#include "cli/output/console.h"
#include "cli/output/convergence_text.h"
#include "cli/output/reply_fields.h"

namespace ls::cli {
namespace {

using nlohmann::json;

constexpr int kPollMilliseconds = 250;

}  // namespace

ProgressFigures progress_of(const json& job) {
  ProgressFigures f;
  f.state = text_field(job, "state");
  f.progress = number_field(job, "progress").value_or(0);
  f.spp_done = number_field(job, "spp_done").value_or(0);
  f.relmse = number_field(job, "relmse");
  f.eta_seconds = number_field(job, "eta_seconds");
  f.eta_ci95 = pair_field(job, "eta_ci95");
  f.relmse_ci95 = pair_field(job, "relmse_ci95");
  f.target_error = number_field(job, "target_error");
  f.target_denoised = text_field(job, "target_layer") == "denoised";
  if (const auto check = job.find("denoised_check"); check != job.end() && check->is_object())
    f.denoised_at_most = number_field(*check, "at_most");
  if (const auto more = job.find("eta_with_more"); more != job.end() && more->is_object()) {
    f.eta_with_more = number_field(*more, "seconds");
    f.more_workers = int_field(*more, "workers", f.more_workers);
  }
  f.doubtful = verdict_of(job).doubtful;
  f.trouble = text_field(job, "error");
  const double elapsed = number_field(job, "elapsed_seconds").value_or(0);
  if (const auto size = pair_field(job, "size"); elapsed > 0 && size)
    f.samples_per_second = f.spp_done * size->first * size->second / elapsed;
  if (const auto frames = job.find("frames"); frames != job.end() && frames->is_object()) {
    const int total = int_field(*frames, "total", 0);
    // spp_done is the mean over the frames, and the rate is that of all frames together
    f.samples_per_second *= total;
    f.frames = fmt::format("{} of {} frames", int_field(*frames, "done", 0), total);
  }
  return f;
}

FarmApi::Answer<json> watch_job(FarmApi& api, const std::string& id, const WatchOptions& options) {
  ProgressBar bar(options.quiet || options.json ? ProgressForm::none : ProgressForm::bar);
  RetryPolicy retry;
  std::string reported;
  for (;; ::poll(nullptr, 0, kPollMilliseconds)) {
    auto job = api.get(job_path(id));
    if (!job) {
      bar.show({.state = "waiting for the coordinator"});
      if (!retry.again(job.error().error)) return job;
      continue;
    }
    retry.answered();
    bar.show(progress_of(*job));
    if (options.json)
      if (const std::string line = job->dump(-1, ' ', false, json::error_handler_t::replace);
          line != reported)
        print(reported = line);
    if (is_over(*job)) return job;
  }
}

int print_end(const json& job, bool quiet) {
  print_health(job);
  const std::string state = text_field(job, "state"), id = text_field(job, "id");
  if (state == "done") {
    if (const std::string worth = error_text(job); !worth.empty() && (!quiet || verdict_of(job).doubtful))
      print_note(worth);
    return kOk;
  }
  const std::string error = text_field(job, "error");
  complain(fmt::format("job {} was {}{}", id, state == "failed" ? "given up" : state,
                       error.empty() ? "" : ": " + error));
  return kFailed;
}

void print_denoised(FarmApi& api, const json& job) {
  // A sequence has no error of its own; the report of each frame has the error of that frame.
  const auto frames = job.find("frames");
  const bool sequence = frames != job.end() && frames->is_object();
  if (!flag_field(job, "denoise") || sequence) return;
  const auto report = api.get(job_path(text_field(job, "id")) + "/report");
  if (!report)
    print_note("the error of the denoised image is unknown: " + report.error().error.message);
  else if (const std::string denoised = denoised_text(*report); !denoised.empty())
    print_note(denoised);
}

}  // namespace ls::cli
