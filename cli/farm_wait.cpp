#include "cli/farm_wait.h"

#include <fmt/format.h>
#include <poll.h>

#include "cli/progress.h"
#include "cli/say.h"
#include "common/base/clock.h"

namespace ls::cli {
namespace {

using nlohmann::json;

constexpr int kPollMilliseconds = 250;
constexpr double kAwaySeconds = 120;  // a coordinator that is away for longer is not waited for

std::optional<double> number(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}

std::string text(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

ProgressFigures figures_of(const json& job) {
  ProgressFigures f;
  f.state = text(job, "state");
  f.progress = number(job, "progress").value_or(0);
  f.spp_done = number(job, "spp_done").value_or(0);
  f.relmse = number(job, "relmse");
  f.eta_seconds = number(job, "eta_seconds");
  f.trouble = text(job, "error");
  const double elapsed = number(job, "elapsed_seconds").value_or(0);
  if (const auto size = job.find("size"); elapsed > 0 && size != job.end() && size->is_array() &&
                                          size->size() == 2 && (*size)[0].is_number() &&
                                          (*size)[1].is_number())
    f.samples_per_second = f.spp_done * (*size)[0].get<double>() * (*size)[1].get<double>() / elapsed;
  return f;
}

bool ended(const json& job) {
  const std::string state = text(job, "state");
  return state == "done" || state == "failed" || state == "cancelled";
}

}  // namespace

FarmApi::Answer<json> watch_job(FarmApi& api, const std::string& id, const WatchOptions& options) {
  ProgressBar bar(options.quiet || options.json);
  const SystemClock clock;
  TimePoint last_answer = clock.now();
  std::string told;
  for (;; ::poll(nullptr, 0, kPollMilliseconds)) {
    auto job = api.get(job_path(id));
    const TimePoint now = clock.now();
    if (!job) {
      const bool away = job.error().error.code == Errc::unavailable;
      if (!away || seconds(now - last_answer) > kAwaySeconds) return job;
      bar.show({.state = "waiting for the coordinator"});
      continue;
    }
    last_answer = now;
    bar.show(figures_of(*job));
    if (options.json)
      if (const std::string line = job->dump(-1, ' ', false, json::error_handler_t::replace); line != told)
        print(told = line);
    if (ended(*job)) return job;
  }
}

int say_end(const json& job) {
  const std::string state = text(job, "state"), id = text(job, "id");
  if (state == "done") return kOk;
  const std::string error = text(job, "error");
  say(fmt::format("lightshaft: error: job {} was {}{}", id, state == "failed" ? "given up" : state,
                  error.empty() ? "" : ": " + error));
  return kFailed;
}

}  // namespace ls::cli
