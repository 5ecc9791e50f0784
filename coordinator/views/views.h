// Views: the data of jobs, frames, tiles and workers for clients, and the functions that write them as JSON
// and CSV. Also what clients may request: jobs, changes of jobs, pages of the list of jobs, pictures, videos.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "coordinator/domain/farm_figures.h"
#include "coordinator/domain/job_failure.h"
#include "coordinator/domain/job_state.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/frame_range.h"
#include "core/base/id.h"
#include "core/image/error/convergence.h"
#include "core/image/film/health.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"
#include "core/image/reference/reference.h"
#include "core/job/health_notes.h"
#include "core/job/settings.h"
#include "core/scene/diagnostic.h"

namespace ls::coordinator {

// How the time of a job was spent, in core seconds of the workers (`merge`: of the coordinator). These totals
// are stored only from time to time: if the coordinator is killed, what was added to them since is lost.
// `render` is not affected, because it is computed again from the stored results.
struct TimeSplit {
  double load = 0;      // fetching files
  double build = 0;     // parsing files, building worlds
  double render = 0;    // CPU time of rendering units (rounds of tiles); see JobView::core_seconds
  double transfer = 0;  // packing results
  double merge = 0;     // on the coordinator: verifying results and adding them to the image
  double idle = 0;      // time of worker threads between two units of the job
  void add(const TimeSplit& o);
  bool operator==(const TimeSplit&) const = default;
};

// A part of TimeSplit, its name in JSON and its description
struct TimePart {
  const char* name;
  double TimeSplit::*seconds;
  const char* doc;
};
inline constexpr TimePart kTimeParts[] = {
    {"load", &TimeSplit::load, "Fetching the job's files."},
    {"build", &TimeSplit::build, "Reading the files and building worlds from them."},
    {"render", &TimeSplit::render, "Rendering: CPU time of units, the same as core_seconds."},
    {"transfer", &TimeSplit::transfer, "Encoding results."},
    {"merge", &TimeSplit::merge, "Checking results and adding them to the image, on the coordinator."},
    {"idle", &TimeSplit::idle, "Idle time of render threads between two units of the job."}};

inline void TimeSplit::add(const TimeSplit& o) {
  for (const TimePart& part : kTimeParts) this->*part.seconds += o.*part.seconds;
}

// Number of additional workers for which JobView::eta_with_more is predicted
inline constexpr int kMoreWorkers = 8;

// Estimated errors of an image: at a checkpoint, or at the end of the job
struct ErrorFigures {
  double rmse = 0;
  double relmse = 0;
  // 95 % interval for the actual relMSE of this image
  double relmse_lo = 0, relmse_hi = 0;
  // 95 % interval for the actual RMSE of this image; both 0: unknown
  double rmse_lo = 0, rmse_hi = 0;
};
// Error of an image against a reference image. The error that the reference's own noise causes is subtracted
// (core/image/reference/reference.h).
struct ReferenceError {
  double rmse = 0, relmse = 0;
  // Mean HDR-FLIP, a perceived error (core/image/reference/flip.h). Computed only each time the number of
  // samples has doubled, and at the job's end; nullopt: not computed
  std::optional<double> flip;
  std::optional<double> mse_stderr = {}, relmse_stderr = {};
  // True if the error is too small to be distinguished from the reference's own noise. Clients then show this
  // fact instead of the error.
  bool rmse_below_noise() const { return below_noise(rmse * rmse, mse_stderr); }
  bool relmse_below_noise() const { return below_noise(relmse, relmse_stderr); }
  bool operator==(const ReferenceError&) const = default;
};
struct ConvergencePoint {
  double seconds = 0;       // time of the checkpoint, in seconds since the job's first ray
  double core_seconds = 0;  // CPU seconds that workers spent on the job until then
  double spp = 0;
  ErrorFigures error;
  // nullopt: the job has no reference, the comparison is not finished, or a restart of the coordinator
  // interrupted it
  std::optional<ReferenceError> reference_error = {};
};

// A sequence is a job with frames. Every frame is also a job; its id consists of the sequence's id and the
// frame's number.
struct FrameId {
  JobId sequence;
  std::uint32_t frame = 0;
};
JobId frame_job(const JobId& sequence, std::uint32_t frame);  // returns, for example, "j-7f3a91c2-frame12"
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
  // Number of the frame to show: the first frame that is being rendered; if there is none, the last frame
  // with finished units; if there is none, the first frame
  std::uint32_t current = 0;
  std::vector<FrameView> all;  // all frames, ascending; filled in by Coordinator::job() only
};

// A job that another one waits for
struct AfterView {
  JobId id;
  std::optional<JobState> state;  // nullopt: there is no such job any more
};

struct JobView {
  JobId id;
  std::string name;  // name of the scene file, for display
  // Name of the user whose token submitted the job. Empty: the administrator submitted it, or it was stored
  // by a version without users.
  std::string owner;
  JobState state = JobState::queued;
  // The reason for which the job ended: "spp" (it has its samples), "error" (it reached its target error),
  // "time" (its time was used up) or "user" (a user cancelled it). Empty: the job is neither done nor
  // cancelled, or the frames of a sequence ended for different reasons.
  std::string stopped;
  double progress = 0;    // from 0 to 1
  std::uint64_t spp = 0;  // requested samples per pixel; if no number was requested, the limit
  bool spp_asked = true;  // false: no number of samples was requested; a target error or a time ends the job
  std::optional<double> target_error;  // relMSE at which the job ends; nullopt: none was requested
  // The layers to which target_error applies
  TargetLayer target_layer = TargetLayer::raw;
  // The latest check of the denoised layers' error; nullopt: target_error does not apply to these layers, or
  // no check was made yet
  std::optional<DenoisedCheck> denoised_check;
  bool denoise = false;  // true: its image also gets denoised layers
  int deep = 0;          // slices of its deep image in each pixel; 0: it has none
  std::optional<DenoisedFigure>
      denoised;         // error of the denoised layers; nullopt: not made yet, or a sequence
  double spp_done = 0;  // samples per pixel so far, mean over all pixels
  std::optional<ErrorFigures> error_now;
  // Error against the reference image, at the last checkpoint that was compared with it; nullopt: no
  // checkpoint was compared yet
  std::optional<ReferenceError> reference_error;
  // True if the reference and the image share scene and seed. They then share their noise as well, so
  // reference_error is meaningless (core/image/reference/reference.h: same_noise())
  bool reference_same_seed = false;
  std::optional<ConvergenceStatus> convergence_status;  // nullopt: no checkpoint yet
  // Number of pixels in which too few samples found light for a reliable error estimate (error_estimate.h),
  // at the last checkpoint; nullopt: no checkpoint yet
  std::optional<std::uint64_t> few_hits;
  bool lit = true;                   // false: no sample had found light at the last checkpoint
  std::optional<Trend> trend;        // nullopt: too few checkpoints
  std::optional<double> efficiency;  // 1 / (relMSE * core seconds) at the last checkpoint
  std::optional<std::uint64_t> pixels_without_samples;  // nullopt: unknown
  std::optional<double> eta_seconds;  // predicted seconds until the job is done; nullopt: unknown
  // 95 % interval of eta_seconds; nullopt unless the target error is predicted to end the job
  std::optional<std::pair<double, double>> eta_ci95;
  // Predicted seconds until the job is done if kMoreWorkers more workers like the present ones joined;
  // nullopt: unknown, or they would not make the job end sooner
  std::optional<double> eta_with_more;
  // 95 % interval of eta_with_more; nullopt unless the target error is predicted to end the job
  std::optional<std::pair<double, double>> eta_with_more_ci95;
  std::string error;                  // why the job failed or waits; empty: it does neither
  std::optional<JobFailure> failure;  // `error` as data, if the job failed because of a unit
  std::vector<std::string> warnings;  // warnings about the scene
  std::vector<AfterView> after;       // jobs that must be done before this one begins, and are not yet
  std::string waits_for;              // says so in words; empty: it waits for no other job
  FrameSize size;
  int tile = 32;
  int meters = 0;  // number of meters; 0: the job makes an image
  int priority = 0;
  std::optional<PixelRect> focus;                       // pixels whose tiles are rendered before the others
  std::optional<std::uint32_t> max_workers, max_units;  // limits that the user requested
  std::uint64_t memory_bytes = 0;                       // least memory that a worker needs for the job
  std::uint64_t units_done = 0, units_total = 0;
  // Predicted CPU seconds of the units that wait for a worker; 0: no cost is known yet
  double queued_core_seconds = 0;
  double elapsed_seconds = 0, core_seconds = 0;
  TimeSplit time;
  double submitted_unix = 0;  // time of submission by the wall clock, for display
  // Numeric health of the job's image: counts of bad samples, such as NaNs. A sequence has only the sums of
  // the three counts over its frames.
  Health health;
  std::vector<HealthNote> notes;  // `health` as sentences for users; empty: no problems
  // The numeric class to which the job is pinned; nullopt: it is pinned to none. `platform` names the
  // machines and the build of this class
  std::optional<Digest> numeric_class;
  std::string platform;
  // The part of the farm that belongs to that class; nullopt: the job is pinned to no class, has ended, or is
  // a sequence
  std::optional<ClassShare> class_share;
  bool fake = false;  // true if fake workers invented its pixels; for a sequence: the pixels of any frame
  // Set only for a sequence. The other values of a sequence's view combine its frames: they are sums over the
  // frames or means over all their pixels. elapsed_seconds counts from the first ray of any frame until now
  // or, once all frames have ended, until the end of the last one.
  std::optional<FramesView> frames;
};

// A user's request to change a job. Either all changes are applied or, if one is rejected, none.
struct JobChange {
  std::optional<JobState> state;  // the new state: paused, running or cancelled
  std::optional<int> priority;
  std::optional<std::uint64_t> spp;  // the new total of samples per pixel
  // The new target error. Allowed only for a job that has a target error and has not ended, or has ended
  // because it reached the target. A smaller target resumes a job that has reached its target.
  std::optional<double> target_error;
  // Pixels whose tiles are rendered before the others from now on. Outer nullopt: no change; inner nullopt:
  // no tiles are preferred any more.
  std::optional<std::optional<PixelRect>> focus = {};
  std::optional<std::vector<std::string>> after = {};  // replaces the jobs that it waits for
  std::optional<std::string> name = {};
};

// How a list of jobs is sorted. `order`: in order of submission. `active`: running jobs first, then paused,
// queued and ended ones; in each of these groups the newest job first. Every other name is that of the value
// to sort by, ascending.
enum class JobOrder { order, active, submitted, name, owner, state, progress, relmse };
inline constexpr std::array<std::string_view, 8> kJobOrders = {"order", "active", "submitted", "name",
                                                               "owner", "state",  "progress",  "relmse"};

// A job is held while it is queued and waits for other jobs (JobSpec::after). This is no state of its own.
inline constexpr std::string_view kHeld = "held";
constexpr bool is_held(JobState state, bool waits) { return state == JobState::queued && waits; }

struct JobsAsked {
  // Returns true if the client may see the jobs of this owner; an empty function: it may see all jobs
  std::function<bool(const std::string& owner)> visible;
  std::set<JobState> states;  // states to list; empty: all
  bool held = false;          // true: lists held jobs, too, or, if `states` is empty, only them (is_held())
  std::optional<std::string> owner;
  std::string search;  // words, each of which the name or id must contain (case is ignored); empty: all jobs
  double since_unix = 0;  // earliest time of submission, in seconds since 1970
  JobOrder by = JobOrder::order;
  bool descending = false;
  std::size_t offset = 0, limit = std::numeric_limits<std::size_t>::max();
};

struct JobsPage {
  std::vector<JobView> jobs;
  std::size_t total = 0;                // number of jobs that match the request; `jobs` is one page of them
  std::array<std::size_t, 6> states{};  // number of visible jobs in each JobState, whether or not they match
  std::size_t held = 0;                 // how many of the queued ones are held
  std::set<std::string> owners;         // owners of all visible jobs
};

struct TileView {
  TileIndex tile = 0;
  PixelRect rect;
  RoundIndex rounds_folded = 0;
  std::uint64_t spp = 0;
  std::optional<double> relmse;      // estimated error of the tile; nullopt: it has no samples yet
  std::vector<std::string> workers;  // names of the workers rendering it now
};

// A request for a rectangle of one layer at one mip level (core/image/exr/pixel_layers.h).
struct PixelsAsked {
  std::string layer;
  int level = 0;
  PixelRect rect;
};

// How the colours of an image are shown.
struct Look {
  double exposure = 0;    // in stops: pixels are multiplied by 2^exposure
  bool denoised = false;  // true: shows the denoised image; requires JobSpec::denoise
  std::string view;       // a view of DisplayViews; empty: sRGB
};

// A request for a video of a sequence.
struct VideoAsked {
  std::optional<double> fps;  // frames of the sequence per second of video; nullopt: those of the job, or 24
  Look look;
};
enum class VideoState { none, waiting, making, ready, failed };
struct VideoView {
  VideoState state = VideoState::none;
  VideoAsked asked;
  std::size_t frames = 0, frames_done = 0;  // number of frames in the video, and of those encoded so far
  std::uint64_t bytes = 0;                  // size of the video file when it is ready
  std::string error;                        // why the video could not be made; empty: it did not fail
};

struct WorkerView {
  WorkerId id;
  std::string name;
  std::string build;
  Digest numeric_class;
  std::string platform;  // machine and build of the numeric class in words; empty: unknown
  bool fake = false;     // true for a fake worker (for tests), which invents its pixels instead of rendering
  int threads = 1;
  std::vector<std::string> tags;
  std::string state;     // "connected", "draining", "restarting", "lost", "sick"
  std::string activity;  // what it does now, in its own words, or what is wrong with it
  std::string job;       // id of the job that it works on; empty: none
  std::uint64_t units_done = 0;
  double cpu_seconds = 0;
  std::uint64_t rss_bytes = 0;
  std::uint64_t memory_bytes = 0;  // memory that its renderer may use; 0: unknown
  double last_seen_seconds = 0;    // seconds since its last message
};

// An event of the stream of events that clients read. `data` is JSON. Ids increase, also over restarts.
struct StreamEvent {
  std::uint64_t id = 0;
  std::string type;  // "job", "tile", "worker"
  std::string data;
  // Id of the job that a `job` or `tile` event reports. Empty: the event does not concern a single job and is
  // sent to every client
  std::string job;
  // Owner of that job; for a `worker` event: the owner of the job that the worker works on
  std::string owner = {};
};

struct SubmitRequest {
  std::string scene_name;  // name of the main file, for diagnostics
  std::string scene_text;  // in any of the scene languages
  // Digests of the files that the scene may name, by file name; the store must have these files
  std::map<std::string, Digest> assets;
  JobSpec spec;
  std::string owner = {};  // the user who submits it: JobView::owner
  // Header `traceparent` of the user's request (util/trace/span.h); a malformed one is ignored
  std::string traceparent = {};
  std::vector<std::string> warnings = {};  // of the program that made the scene of another file
};
struct Rejected {
  Error error;
  std::vector<Diagnostic> diagnostics;
};
inline tl::unexpected<Rejected> rejected(Error error, std::vector<Diagnostic> diagnostics = {}) {
  return tl::unexpected(Rejected{std::move(error), std::move(diagnostics)});
}

// These functions write views as JSON or CSV. In JSON, values that are not set are null.
std::string time_json(const TimeSplit& time);
std::string job_json(const JobView& job);
// Returns {"jobs": [...], "total": number, "states": {STATE or "held": number of jobs}, "owners": [...]}.
std::string jobs_json(const JobsPage& page);
std::string worker_json(const WorkerView& worker);
std::string workers_json(const std::vector<WorkerView>& workers);  // returns {"workers": [...]}
std::string video_json(const VideoView& video);
std::string tiles_json(const std::vector<TileView>& tiles);                // returns {"tiles": [...]}
std::string convergence_csv(const std::vector<ConvergencePoint>& points);  // starts with a header line

// The functions below return the JSON data of events for clients. The `state` of a tile is "leased" (assigned
// to a worker), "folded" (a result was added to the image) or "free".
std::string tile_event_json(const JobId& job, TileIndex tile, const PixelRect& rect, std::string_view state,
                            std::uint64_t spp, std::string_view worker);
std::string worker_gone_json(const WorkerId& worker);
std::string job_removed_json(const JobId& job);  // data of a job's last event, sent when it is removed
// Returns the data of the last `job` event that this coordinator sends for the job, when another coordinator
// has taken the job over.
std::string job_moved_json(const JobId& job);

}  // namespace ls::coordinator
