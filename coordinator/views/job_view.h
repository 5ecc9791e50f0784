// Views: what clients see of jobs, frames, tiles and workers. Also the changes that a user may request of a
// job.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/digest.h"
#include "common/base/frame_range.h"
#include "common/base/id.h"
#include "common/image/error/convergence.h"
#include "common/image/film/health.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"
#include "common/image/reference/reference.h"
#include "common/job/health_notes.h"
#include "coordinator/domain/job_state.h"
#include "coordinator/domain/time_split.h"

namespace ls::coordinator {

inline constexpr int kMoreWorkers = 8;  // workers that JobView::eta_with_more adds

struct ErrorFigures {  // estimated errors of the image that was folded up to one complete round in all tiles
  double rmse = 0;
  double relmse = 0;
  double relmse_lo = 0, relmse_hi = 0;  // 95 % intervals for the realised error
  double rmse_lo = 0, rmse_hi = 0;      // both are 0 if unknown: a version without them stored the error
};
// Error against a reference image, from which the reference's own noise is subtracted
// (common/image/reference/reference.h)
struct ReferenceError {
  double rmse = 0, relmse = 0;
  // Mean HDR-FLIP (common/image/reference/flip.h); computed when the samples have doubled, and at the end
  std::optional<double> flip;
  std::optional<double> mse_stderr = {}, relmse_stderr = {};
  // True if the error is too small to be distinguished from the reference's own noise. Clients then show this
  // fact instead of the error.
  bool rmse_below_noise() const { return below_noise(rmse * rmse, mse_stderr); }
  bool relmse_below_noise() const { return below_noise(relmse, relmse_stderr); }
  bool operator==(const ReferenceError&) const = default;
};
struct ConvergencePoint {
  double seconds = 0;       // seconds since the first ray
  double core_seconds = 0;  // CPU seconds of workers for these samples
  double spp = 0;
  ErrorFigures error;
  // nullopt: the job has no reference, the comparison is not finished, or the coordinator was restarted
  // during the checkpoint
  std::optional<ReferenceError> reference_error = {};
};

// A sequence is a job with frames. Every frame is a job, too; its id is made of the sequence's id and the
// frame's number.
struct FrameId {
  JobId sequence;
  std::uint32_t frame = 0;
};
JobId frame_job(const JobId& sequence, std::uint32_t frame);  // "j-7f3a91c2-frame12"
std::optional<FrameId> frame_of(const JobId& job);            // nullopt: the job is not a frame

struct FrameView {
  std::uint32_t frame = 0;
  JobId job;
  JobState state = JobState::queued;
  double progress = 0;
  double spp_done = 0;
  std::optional<double> relmse;
  std::string error;
};
struct FramesView {
  FrameRange range;
  std::uint32_t total = 0, done = 0, running = 0, failed = 0, cancelled = 0;
  std::uint32_t current = 0;   // the frame to show: the first that is being rendered, or has been
  std::vector<FrameView> all;  // all frames, ascending; filled in by Coordinator::job() only
};

struct JobView {
  JobId id;
  std::string name;  // name of the scene file, for display
  // The user whose token submitted it. Empty: the administrator, or it was submitted before there were users
  std::string owner;
  JobState state = JobState::queued;
  std::string stopped;    // "spp", "error", "time", "user" once done
  double progress = 0;    // 0..1
  std::uint64_t spp = 0;  // samples per pixel: requested, or the limit
  bool spp_asked = true;  // false: no number of samples was requested; its target error or its time ends it
  std::optional<double> target_error;  // relMSE at which the job is to end, if requested
  bool denoise = false;                // its image also gets denoised layers
  double spp_done = 0;                 // samples per pixel so far, mean over all pixels
  std::optional<ErrorFigures> error_now;
  // At the last checkpoint that was compared with the reference
  std::optional<ReferenceError> reference_error;
  // True if the reference and the image share scene and seed. Then they share their noise as well, and
  // reference_error means nothing (see same_noise() there)
  bool reference_same_seed = false;
  std::optional<ConvergenceStatus> convergence_status;  // nullopt: no samples yet
  std::optional<std::uint64_t> few_hits;                // pixels with few hits in the current image
  std::optional<Trend> trend;                           // nullopt: too few checkpoints
  std::optional<double> efficiency;                     // 1 / (relMSE x core seconds) at the last checkpoint
  std::optional<std::uint64_t> pixels_without_samples;  // in the current image; nullopt: unknown
  std::optional<double> eta_seconds;
  // 95 % interval of eta_seconds, if an error target ends the job
  std::optional<std::pair<double, double>> eta_ci95;
  // eta_seconds if kMoreWorkers more workers like the present ones joined
  std::optional<double> eta_with_more;
  // Interval of eta_with_more, if an error target ends the job
  std::optional<std::pair<double, double>> eta_with_more_ci95;
  std::string error;                  // why it failed, or why it waits
  std::vector<std::string> warnings;  // warnings about the scene
  FrameSize size;
  int tile = 32;
  int priority = 0;
  std::optional<std::uint32_t> max_workers, max_units;  // requested
  std::uint64_t memory_bytes = 0;                       // the least memory that a worker needs for it
  std::uint64_t units_done = 0, units_total = 0;
  // Predicted CPU seconds of units that wait for a worker; 0: nothing measured yet
  double queued_core_seconds = 0;
  double elapsed_seconds = 0, core_seconds = 0;
  TimeSplit time;
  double submitted_unix = 0;  // time of submission by the wall clock, for display
  Health health;  // numeric health of its folded units (rounds of tiles); for a sequence only the totals
  std::vector<HealthNote> notes;  // the same as sentences for people; empty: no problems
  bool fake = false;  // true if fake workers made up its pixels; of a sequence: those of any frame
  // Set only for a sequence. Its other values combine all frames: they are sums or means over pixels, and
  // elapsed_seconds counts from the first ray of any frame to the last fold.
  std::optional<FramesView> frames;
};

// Changes that a user requests of a job. Either all are applied or, if any is rejected, none.
struct JobChange {
  std::optional<JobState> state;  // the new state: paused, running or cancelled
  std::optional<int> priority;
  std::optional<std::uint64_t> spp;  // the new total of samples per pixel
  // The new target error; only for a job that has one and was not stopped for another reason. A smaller
  // target resumes a job that reached the larger one
  std::optional<double> target_error;
};

struct TileView {
  TileIndex tile = 0;
  PixelRect rect;
  RoundIndex rounds_folded = 0;
  std::uint64_t spp = 0;
  std::optional<double> relmse;      // estimated error of the tile; nullopt: it has no samples yet
  std::vector<std::string> workers;  // names of the workers rendering it now
};

struct WorkerView {
  WorkerId id;
  std::string name;
  std::string build;
  Digest numeric_class;
  bool fake = false;  // a fake worker (for tests) renders nothing and makes up its pixels
  int threads = 1;
  std::vector<std::string> tags;
  std::string state;     // "connected", "draining", "lost", "sick"
  std::string activity;  // as last reported by the worker
  std::string job;       // the job it works on; may be empty
  std::uint64_t units_done = 0;
  double cpu_seconds = 0;
  std::uint64_t rss_bytes = 0;
  std::uint64_t memory_bytes = 0;  // memory that it may use; 0: unknown
  double last_seen_seconds = 0;    // seconds since its last message
};

// An event of the event stream. `data` is JSON. Ids increase by one and survive restarts.
struct StreamEvent {
  std::uint64_t id = 0;
  std::string type;  // "job", "tile", "worker"
  std::string data;
  // The job that a `job` or `tile` event is about. Empty: the event is about no single job and is sent to
  // every reader
  std::string job;
  std::string owner = {};  // owner of that job; for a `worker` event: of the job that the worker works on
};

}  // namespace ls::coordinator
