#include "coordinator/http/metrics.h"

#include <fmt/format.h>

#include <iterator>

namespace ls::http {
namespace {

using coordinator::JobState;

void head(std::string& out, std::string_view name, std::string_view type, std::string_view help) {
  fmt::format_to(std::back_inserter(out), "# HELP {} {}\n# TYPE {} {}\n", name, help, name, type);
}

template <class Value>
void single(std::string& out, std::string_view name, std::string_view type, std::string_view help,
            Value value) {
  head(out, name, type, help);
  fmt::format_to(std::back_inserter(out), "{} {}\n", name, value);
}

bool unfinished(JobState state) {
  return state == JobState::queued || state == JobState::running || state == JobState::paused;
}

void write_jobs(std::string& out, std::span<const coordinator::JobView> jobs) {
  static constexpr JobState kStates[] = {JobState::queued, JobState::running, JobState::paused,
                                         JobState::done,   JobState::failed,  JobState::cancelled};
  std::map<JobState, std::uint64_t> by_state;
  std::uint64_t done = 0, planned = 0;
  double core_seconds = 0, eta = 0, queued = 0;
  Health health;
  for (const auto& job : jobs) {
    ++by_state[job.state];
    core_seconds += job.core_seconds;
    health.nonfinite += job.health.nonfinite;
    health.majorant_violations += job.health.majorant_violations;
    if (!unfinished(job.state)) continue;
    done += job.units_done;
    planned += job.units_total;
    eta += job.eta_seconds.value_or(0);
    if (job.state != JobState::paused) queued += job.queued_core_seconds;
  }
  head(out, "lightshaft_jobs", "gauge", "Jobs by state.");
  for (const JobState state : kStates)
    fmt::format_to(std::back_inserter(out), "lightshaft_jobs{{state=\"{}\"}} {}\n", to_string(state),
                   by_state[state]);
  single(out, "lightshaft_units_planned", "gauge", "Units of unfinished jobs.", planned);
  single(out, "lightshaft_units_done", "gauge", "Units of unfinished jobs that are folded.", done);
  single(out, "lightshaft_queued_core_seconds", "gauge",
         "Predicted CPU seconds of units that wait for a worker, of jobs that are not paused.", queued);
  single(out, "lightshaft_eta_seconds", "gauge",
         "Predicted wall seconds to finish all jobs whose rate is known.", eta);
  single(out, "lightshaft_core_seconds", "gauge", "CPU seconds that workers spent on the jobs kept here.",
         core_seconds);
  single(out, "lightshaft_nonfinite_samples", "gauge", "Samples counted as non-finite; zero on healthy jobs.",
         health.nonfinite);
  single(out, "lightshaft_majorant_violations", "gauge", "Densities above their bound; zero on healthy jobs.",
         health.majorant_violations);
}

void write_workers(std::string& out, std::span<const coordinator::WorkerView> workers) {
  std::map<std::string, std::uint64_t> by_state{{"connected", 0}, {"draining", 0}, {"lost", 0}, {"sick", 0}};
  std::uint64_t threads = 0;
  for (const auto& worker : workers) {
    ++by_state[worker.state];
    if (worker.state == "connected") threads += static_cast<std::uint64_t>(worker.threads);
  }
  head(out, "lightshaft_workers", "gauge", "Workers by state.");
  for (const auto& [state, count] : by_state)
    fmt::format_to(std::back_inserter(out), "lightshaft_workers{{state=\"{}\"}} {}\n", state, count);
  single(out, "lightshaft_worker_threads", "gauge", "Render threads of connected workers.", threads);
}

}  // namespace

void Counters::answered(Method method, int status) {
  const std::lock_guard lock(mutex_);
  ++requests_[{method, status}];
}

std::map<std::pair<Method, int>, std::uint64_t> Counters::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

std::string metrics_text(std::span<const coordinator::JobView> jobs,
                         std::span<const coordinator::WorkerView> workers, std::uint64_t last_event,
                         const Counters& counters, const coordinator::StoreStatus& store) {
  std::string out;
  write_jobs(out, jobs);
  write_workers(out, workers);
  single(out, "lightshaft_events_total", "counter", "Id of the last event.", last_event);
  head(out, "lightshaft_http_requests_total", "counter", "Requests answered.");
  for (const auto& [key, count] : counters.requests())
    fmt::format_to(std::back_inserter(out),
                   "lightshaft_http_requests_total{{method=\"{}\",code=\"{}\"}} {}\n", to_string(key.first),
                   key.second, count);
  single(out, "lightshaft_http_connections", "gauge", "Open HTTP connections.", counters.connections.load());
  single(out, "lightshaft_http_event_streams", "gauge", "Open event streams.", counters.event_streams.load());
  single(out, "lightshaft_http_slow_readers_total", "counter",
         "Event streams closed because the reader was too slow.", counters.events_dropped.load());
  single(out, "lightshaft_http_body_bytes_total", "counter", "Bytes of request bodies.",
         counters.body_bytes.load());
  if (!store.mirror.empty()) {
    single(out, "lightshaft_redis_up", "gauge", "1 while Redis answers.", store.trouble.empty() ? 1 : 0);
    single(out, "lightshaft_redis_jobs_behind", "gauge", "Jobs of which Redis has not been told all.", store.behind);
  }
  return out;
}

}  // namespace ls::http
