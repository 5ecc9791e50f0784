// /metrics in Prometheus' text format
#include "coordinator/http/api/metrics.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "coordinator/http/api/handlers.h"

namespace ls::http {
namespace {

std::uint64_t status_figure(const std::string& name) {
  std::ifstream in("/proc/self/status");
  std::string word;
  std::uint64_t value = 0;
  while (in >> word)
    if (word == name) return in >> value ? value : 0;
  return 0;
}

std::uint64_t files_in(const char* folder) {
  std::error_code failed;
  std::uint64_t count = 0;
  for (std::filesystem::directory_iterator at(folder, failed), end; !failed && at != end;
       at.increment(failed))
    ++count;
  // In /proc/self/fd, directory_iterator also lists its own open descriptor, which is not counted
  return failed || count == 0 ? 0 : count - 1;
}

}  // namespace

ProcessFigures process_figures() {
  ProcessFigures p;
  p.resident_bytes = status_figure("VmRSS:") * 1024;
  p.threads = status_figure("Threads:");
  p.open_files = files_in("/proc/self/fd");
  rusage usage{};
  if (::getrusage(RUSAGE_SELF, &usage) == 0)
    for (const timeval& part : {usage.ru_utime, usage.ru_stime})
      p.cpu_seconds += static_cast<double>(part.tv_sec) + 1e-6 * static_cast<double>(part.tv_usec);
  return p;
}

namespace {

using coordinator::JobState;

// Writes the lines HELP and TYPE of a metric. Its type is counter if the name ends with _total, else gauge.
void head(std::string& out, std::string_view name, std::string_view help) {
  fmt::format_to(std::back_inserter(out), "# HELP {} {}\n# TYPE {} {}\n", name, help, name,
                 name.ends_with("_total") ? "counter" : "gauge");
}

template <class Value>
void single(std::string& out, std::string_view name, std::string_view help, Value value) {
  head(out, name, help);
  fmt::format_to(std::back_inserter(out), "{} {}\n", name, value);
}

// The values of a metric, each with the label value to which it belongs.
using LabelledValues = std::vector<std::pair<std::string_view, std::uint64_t>>;
void labelled(std::string& out, std::string_view name, std::string_view help, std::string_view label,
              const LabelledValues& values) {
  head(out, name, help);
  for (const auto& [word, value] : values)
    fmt::format_to(std::back_inserter(out), "{}{{{}=\"{}\"}} {}\n", name, label, word, value);
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
    if (is_terminal(job.state)) continue;
    done += job.units_done;
    planned += job.units_total;
    eta += job.eta_seconds.value_or(0);
    if (job.state != JobState::paused) queued += job.queued_core_seconds;
  }
  LabelledValues states;
  for (const JobState state : kStates) states.emplace_back(to_string(state), by_state[state]);
  labelled(out, "lightshaft_jobs", "Number of jobs in each state.", "state", states);
  single(out, "lightshaft_units_planned", "Number of units that the unfinished jobs consist of.", planned);
  single(out, "lightshaft_units_done",
         "Number of units of unfinished jobs that have been added to the image.", done);
  single(out, "lightshaft_queued_core_seconds",
         "Predicted CPU seconds of all units that wait for a worker. Paused jobs do not count.", queued);
  single(out, "lightshaft_eta_seconds",
         "Predicted seconds until all jobs are done. Jobs whose rate is unknown do not count.", eta);
  single(out, "lightshaft_core_seconds",
         "CPU seconds that workers have spent on the jobs of this coordinator.", core_seconds);
  single(out, "lightshaft_nonfinite_samples",
         "Number of samples that were not finite. Healthy jobs have none.", health.nonfinite);
  single(out, "lightshaft_majorant_violations",
         "How often a medium's density exceeded its upper bound. Healthy jobs have none.",
         health.majorant_violations);
}

void write_workers(std::string& out, std::span<const coordinator::WorkerView> workers) {
  std::map<std::string, std::uint64_t> by_state{
      {"connected", 0}, {"draining", 0}, {"restarting", 0}, {"lost", 0}, {"sick", 0}};
  std::uint64_t threads = 0, fake = 0;
  for (const auto& worker : workers) {
    ++by_state[worker.state];
    if (worker.state != "connected") continue;
    threads += static_cast<std::uint64_t>(worker.threads);
    fake += worker.fake;
  }
  labelled(out, "lightshaft_workers", "Number of workers in each state.", "state",
           {by_state.begin(), by_state.end()});
  single(out, "lightshaft_worker_threads", "Number of render threads of the connected workers.", threads);
  single(out, "lightshaft_workers_fake", "Number of connected fake workers, which invent their pixels.",
         fake);
}

void write_leases(std::string& out, const coordinator::FarmFigures& f) {
  single(out, "lightshaft_leases", "Number of leases that workers hold now.", f.leases_now);
  single(out, "lightshaft_units_leased", "Number of units that are leased now.", f.units_leased_now);
  single(out, "lightshaft_leases_granted_total", "Number of leases that workers have received.",
         f.leases_granted);
  single(out, "lightshaft_units_leased_total", "Number of units that have been leased to workers.",
         f.units_leased);
  // Causes that freed no unit are listed, too, with the value 0: Prometheus computes the rate of a counter
  // only from values that it has seen, so a counter that first appeared with 1 would lose that event.
  LabelledValues freed;
  for (const auto& [cause, word] : coordinator::kFreedCauses) {
    const auto count = f.units_freed.find(cause);
    freed.emplace_back(word, count == f.units_freed.end() ? 0 : count->second);
  }
  labelled(out, "lightshaft_units_freed_total",
           "Number of leased units that came back without a result, by cause. Units that are still needed "
           "are leased again.",
           "cause", freed);
}

void write_results(std::string& out, const coordinator::FarmFigures& f) {
  labelled(out, "lightshaft_results_total",
           "Number of results from workers, by what became of them. `equal` and `differing` compare a second "
           "result of a unit with the first.",
           "verdict",
           {{"accepted", f.accepted},
            {"equal", f.equal},
            {"differing", f.differing},
            {"unwanted", f.unwanted},
            {"refused", f.refused},
            {"not_stored", f.not_stored}});
  single(out, "lightshaft_units_folded_total", "Number of units that have been added to images.", f.folded);
  single(out, "lightshaft_fold_lag_seconds_total",
         "Sum over all units added to images: seconds from the arrival of the result until it was added.",
         f.fold_lag_seconds);
  single(out, "lightshaft_results_arrived", "Number of results that are being verified and stored now.",
         f.arrived_now);
  single(out, "lightshaft_results_arrived_bytes",
         "Memory that results take while they are verified and stored.", f.arrived_bytes);
  single(out, "lightshaft_results_waiting",
         "Number of accepted results that wait for an earlier round of their tile.", f.waiting_now);
  single(out, "lightshaft_background_writes", "Number of writes that wait for the disk.",
         f.background_writes_now);
  single(out, "lightshaft_result_bytes_total", "Bytes of results received from workers.", f.result_bytes);
  single(out, "lightshaft_blob_bytes_total", "Bytes of blobs sent to workers.", f.blob_bytes);
}

void write_audits(std::string& out, const coordinator::AuditFigures& a) {
  labelled(out, "lightshaft_audits_total",
           "Number of audits, by outcome. An audit renders a unit again on another worker and compares the "
           "results.",
           "verdict", {{"asked", a.asked}, {"equal", a.equal}, {"differ", a.differ}, {"dropped", a.dropped}});
  single(out, "lightshaft_workers_quarantined_total",
         "Number of workers that were quarantined because they rendered wrong pixels.",
         a.workers_quarantined);
  single(out, "lightshaft_tiles_discarded_total",
         "Number of tiles that were rendered again because a quarantined worker had rendered part of them.",
         a.tiles_discarded);
}

void write_webhooks(std::string& out, const coordinator::WebhookFigures& w) {
  labelled(out, "lightshaft_webhook_sendings_total",
           "Number of attempts to send an event to a webhook. A failed attempt is repeated later.", "result",
           {{"taken", w.delivered}, {"failed", w.failed_attempts}});
  single(out, "lightshaft_webhooks_given_up_total",
         "Number of events that were given up because the webhook never accepted them.", w.given_up);
  single(out, "lightshaft_webhooks_waiting", "Number of events that wait to be sent to webhooks.", w.waiting);
}

void write_traces(std::string& out, const trace::Figures& f) {
  labelled(out, "lightshaft_trace_spans_total",
           "Number of trace spans: accepted by the collector, refused or not confirmed by it, and left out "
           "because too many were waiting.",
           "result", {{"taken", f.sent}, {"refused", f.refused}, {"left out", f.left_out}});
}

void write_process(std::string& out) {
  const ProcessFigures p = process_figures();
  single(out, "process_resident_memory_bytes", "Resident memory of the coordinator in bytes.",
         p.resident_bytes);
  single(out, "process_open_fds", "Number of files and sockets that the coordinator has open.", p.open_files);
  single(out, "process_threads", "Number of threads of the coordinator.", p.threads);
  single(out, "process_cpu_seconds_total", "CPU time of the coordinator in seconds.", p.cpu_seconds);
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

Response get_metrics(Api& api, const Request&, const Params&) {
  auto& coordinator = api.coordinator();
  const Counters& counters = api.counters();
  const coordinator::FarmFigures farm = coordinator.figures();
  std::string out;
  write_jobs(out, coordinator.jobs());
  write_workers(out, coordinator.workers());
  write_leases(out, farm);
  write_results(out, farm);
  write_audits(out, coordinator.audits());
  write_process(out);
  single(out, "lightshaft_events_total", "Number of events so far, which is also the id of the last one.",
         coordinator.last_event_id());
  head(out, "lightshaft_http_requests_total", "Number of requests that have been answered.");
  for (const auto& [key, count] : counters.requests())
    fmt::format_to(std::back_inserter(out),
                   "lightshaft_http_requests_total{{method=\"{}\",code=\"{}\"}} {}\n", to_string(key.first),
                   key.second, count);
  single(out, "lightshaft_http_connections", "Number of open HTTP connections.", counters.connections.load());
  single(out, "lightshaft_http_event_streams", "Number of open event streams.",
         counters.event_streams.load());
  single(out, "lightshaft_http_slow_readers_total",
         "Number of event streams that were closed because the client read too slowly.",
         counters.events_dropped.load());
  single(out, "lightshaft_http_body_bytes_total", "Bytes of request bodies received.",
         counters.body_bytes.load());
  if (const auto webhooks = api.webhooks()) write_webhooks(out, *webhooks);
  if (const auto traces = api.traces()) write_traces(out, *traces);
  if (const auto store = coordinator.store_status(); !store.mirror.empty()) {
    single(out, "lightshaft_redis_up", "1 if Redis responds, else 0.", store.trouble.empty() ? 1 : 0);
    single(out, "lightshaft_redis_jobs_behind", "Number of jobs whose latest state is not in Redis yet.",
           store.behind);
  }
  return text_response(200, "text/plain; version=0.0.4; charset=utf-8", std::move(out));
}

}  // namespace ls::http
