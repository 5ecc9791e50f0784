// The states of jobs and workers and the reasons why jobs stop, each with its name in the HTTP API. Also
// DenoisedCheck, a measurement of the error of denoised layers, by which jobs with a target for this error
// end.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

namespace ls::coordinator {

// `queued`: no unit (round of a tile) has been assigned to a worker yet. The last three are final, with one
// exception: more samples or a smaller target error resume a `done` job.
enum class JobState { queued, running, paused, done, failed, cancelled };
constexpr std::string_view to_string(JobState state) {
  constexpr std::string_view kWords[] = {"queued", "running", "paused", "done", "failed", "cancelled"};
  return kWords[static_cast<std::size_t>(state)];
}
// True for failed and cancelled: a job never leaves these states.
constexpr bool is_closed(JobState state) { return state == JobState::failed || state == JobState::cancelled; }
// True for done, failed and cancelled.
constexpr bool is_terminal(JobState state) { return state == JobState::done || is_closed(state); }

// Why a job is done: it has its samples per pixel, has reached its target error, has used up its time, or its
// user stopped it.
enum class StopReason { spp, error, time, user };
constexpr std::string_view to_string(StopReason reason) {
  constexpr std::string_view kWords[] = {"spp", "error", "time", "user"};
  return kWords[static_cast<std::size_t>(reason)];
}

// A worker is unhealthy if it has failed repeatedly in two jobs (kUnhealthyJobs), or is quarantined. In the
// HTTP API this state is "sick". `restarting`: it drains, and then restarts its program.
enum class WorkerState { connected, draining, restarting, lost, unhealthy };
constexpr std::string_view to_string(WorkerState state) {
  constexpr std::string_view kWords[] = {"connected", "draining", "restarting", "lost", "sick"};
  return kWords[static_cast<std::size_t>(state)];
}

// True if the worker takes no more units, since it will end or restart.
constexpr bool is_leaving(WorkerState state) {
  return state == WorkerState::draining || state == WorkerState::restarting;
}

// The error of the denoised layers at one level of the stop rule (adaptive_stop.h). A level determines how
// many samples each tile gets; each further level gives more.
struct DenoisedCheck {
  double spp = 0;     // samples per pixel at this level, mean over all pixels; identifies the level
  double relmse = 0;  // estimated relMSE of the denoised layers; noise of the estimate can make it negative
  // Upper end of the 95 % confidence interval of `relmse`; nullopt: the interval is not known
  std::optional<double> at_most;
  bool operator==(const DenoisedCheck&) const = default;
};

// The error of the denoised layers of a finished image
struct DenoisedFigure {
  double relmse = 0;
  std::optional<std::pair<double, double>> relmse_ci95;  // nullopt: the interval is not known
  bool operator==(const DenoisedFigure&) const = default;
};

}  // namespace ls::coordinator
