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

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/base/frame_range.h"
#include "common/base/id.h"
#include "common/image/error/convergence.h"
#include "common/image/film/health.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"
#include "common/image/reference/reference.h"
#include "common/job/health_notes.h"
#include "common/job/settings.h"
#include "common/scene/diagnostic.h"
#include "coordinator/domain/farm_figures.h"
#include "coordinator/domain/job_state.h"

namespace ls::coordinator {

// How the time of a job was spent, in core seconds of the workers (`merge`: of the coordinator). These totals
// are stored now and then: if the coordinator is killed, all but `render` lose what was added since.
struct TimeSplit {
  double load = 0;      // fetching files
  double build = 0;     // parsing files, building worlds
  double render = 0;    // CPU time of units (rounds of tiles): JobView::core_seconds
  double transfer = 0;  // packing results
  double merge = 0;     // coordinator: verifying results and adding them to the image
  double idle = 0;      // worker threads between two units of the job
  void add(const TimeSplit& o);
  bool operator==(const TimeSplit&) const = default;
};

// The name in JSON of each part, for writing and reading
struct TimePart {
  const char* name;
  double TimeSplit::*seconds;
};
inline constexpr TimePart kTimeParts[] = {{"load", &TimeSplit::load},     {"build", &TimeSplit::build},
                                          {"render", &TimeSplit::render}, {"transfer", &TimeSplit::transfer},
                                          {"merge", &TimeSplit::merge},   {"idle", &TimeSplit::idle}};

inline void TimeSplit::add(const TimeSplit& o) {
  for (const TimePart& part : kTimeParts) this->*part.seconds += o.*part.seconds;
}

// JobView::eta_with_more is the prediction for this many workers more
inline constexpr int kMoreWorkers = 8;

// Estimated errors of an image: at a checkpoint, or at the end of the job
struct ErrorFigures {
  double rmse = 0;
  double relmse = 0;
  // 95 % interval for the actual relMSE of this image
  double relmse_lo = 0, relmse_hi = 0;
  // The same for the RMSE; both 0: unknown
  double rmse_lo = 0, rmse_hi = 0;
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
  // The frame to show: the first one that is being rendered, else the last one with finished units, else the
  // first
  std::uint32_t current = 0;
  std::vector<FrameView> all;  // all frames, ascending; filled in by Coordinator::job() only
};

struct JobView {
  JobId id;
  std::string name;  // name of the scene file, for display
  // The user who submitted it, by token. Empty: the administrator, or the job was stored before users existed
  std::string owner;
  JobState state = JobState::queued;
  std::string stopped;    // once done or cancelled: "spp", "error", "time" or "user"
  double progress = 0;    // 0..1
  std::uint64_t spp = 0;  // samples per pixel: requested, or the limit
  bool spp_asked = true;  // false: no number of samples was requested; a target error or a time ends the job
  std::optional<double> target_error;  // relMSE at which the job is to end, if requested
  // the layers whose relMSE target_error limits
  TargetLayer target_layer = TargetLayer::raw;
  // the latest check of the denoised layers' error, if target_error limits that error
  std::optional<DenoisedCheck> denoised_check;
  bool denoise = false;  // its image also gets denoised layers
  double spp_done = 0;   // samples per pixel so far, mean over all pixels
  std::optional<ErrorFigures> error_now;
  // Error against the reference, at the last checkpoint that was compared
  std::optional<ReferenceError> reference_error;
  // True if the reference and the image share scene and seed. They then share their noise as well, so
  // reference_error is meaningless (common/image/reference/reference.h: same_noise())
  bool reference_same_seed = false;
  std::optional<ConvergenceStatus> convergence_status;  // nullopt: no samples yet
  std::optional<std::uint64_t> few_hits;                // pixels with few hits in the current image
  std::optional<Trend> trend;                           // nullopt: too few checkpoints
  std::optional<double> efficiency;                     // 1 / (relMSE x core seconds) at the last checkpoint
  std::optional<std::uint64_t> pixels_without_samples;  // number in the current image; nullopt: unknown
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
  std::optional<PixelRect> focus;                       // pixels whose tiles are rendered before the others
  std::optional<std::uint32_t> max_workers, max_units;  // limits that the user requested
  std::uint64_t memory_bytes = 0;                       // the least memory that a worker needs for it
  std::uint64_t units_done = 0, units_total = 0;
  // Predicted CPU seconds of the units that wait for a worker; 0: no cost is known yet
  double queued_core_seconds = 0;
  double elapsed_seconds = 0, core_seconds = 0;
  TimeSplit time;
  double submitted_unix = 0;  // time of submission by the wall clock, for display
  // Numeric health of the units in its image (rounds of tiles); for a sequence only the totals
  Health health;
  std::vector<HealthNote> notes;  // the numeric health as sentences for users; empty: no problems
  // The numeric class (machines that compute the same bits) that it is pinned to, and the class's platform
  std::optional<Digest> numeric_class;
  std::string platform;
  // How much of the farm is of that class; nullopt: the job is pinned to none, has ended, or is a sequence
  std::optional<ClassShare> class_share;
  bool fake = false;  // true if fake workers invented its pixels; for a sequence: the pixels of any frame
  // Set only for a sequence. The other values of its view combine all frames: they are sums or means over
  // pixels, and elapsed_seconds counts from the first ray of any frame until the last result was added to an
  // image.
  std::optional<FramesView> frames;
};

// A user's request to change a job. Either all changes are applied or, if one is rejected, none.
struct JobChange {
  std::optional<JobState> state;  // the new state: paused, running or cancelled
  std::optional<int> priority;
  std::optional<std::uint64_t> spp;  // the new total of samples per pixel
  // The new target error; only for a job that has one and did not end for another reason. A smaller target
  // resumes a job that reached the larger one
  std::optional<double> target_error;
  // Pixels whose tiles are rendered before the others from now on; inner nullopt: no tile goes first any more
  std::optional<std::optional<PixelRect>> focus = {};
};

// `order`: order of submission. `active`: running jobs first, then paused, queued and ended ones; among
// equals the newest first.
enum class JobOrder { order, active, submitted, name, owner, state, progress, relmse };
inline constexpr std::array<std::string_view, 8> kJobOrders = {"order", "active", "submitted", "name",
                                                               "owner", "state",  "progress",  "relmse"};

struct JobsAsked {
  // True for owners whose jobs the client may see; empty: all owners
  std::function<bool(const std::string& owner)> visible;
  std::set<JobState> states;  // states to list; empty: all
  std::optional<std::string> owner;
  std::string search;     // part of the name or the id, in upper or lower case
  double since_unix = 0;  // lists only jobs submitted at this time or later
  JobOrder by = JobOrder::order;
  bool descending = false;
  std::size_t offset = 0, limit = std::numeric_limits<std::size_t>::max();
};

struct JobsPage {
  std::vector<JobView> jobs;
  std::size_t total = 0;                // number of jobs that match the request; `jobs` is one page of them
  std::array<std::size_t, 6> states{};  // number of visible jobs in each JobState, whether or not they match
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

// A request for a rectangle of one layer at one mip level (common/image/exr/pixel_layers.h).
struct PixelsAsked {
  std::string layer;
  int level = 0;
  PixelRect rect;
};

// A request for a video of a sequence.
struct VideoAsked {
  double fps = 24;        // pictures per second
  double exposure = 0;    // stops
  bool denoised = false;  // true: shows the denoised images; requires JobSpec::denoise
};
enum class VideoState { none, waiting, making, ready, failed };
struct VideoView {
  VideoState state = VideoState::none;
  VideoAsked asked;
  std::size_t frames = 0, frames_done = 0;  // number of frames in the video, and of those encoded so far
  std::uint64_t bytes = 0;                  // size of a video that is ready
  std::string error;                        // why it failed
};

struct WorkerView {
  WorkerId id;
  std::string name;
  std::string build;
  Digest numeric_class;
  std::string platform;  // machine and build of the class; empty: unknown
  bool fake = false;     // true for a fake worker (for tests), which invents its pixels instead of rendering
  int threads = 1;
  std::vector<std::string> tags;
  std::string state;     // "connected", "draining", "lost", "sick"
  std::string activity;  // as last reported by the worker
  std::string job;       // the job it works on; may be empty
  std::uint64_t units_done = 0;
  double cpu_seconds = 0;
  std::uint64_t rss_bytes = 0;
  std::uint64_t memory_bytes = 0;  // memory that its renderer may use; 0: unknown
  double last_seen_seconds = 0;    // seconds since its last message
};

// An event of the event stream. `data` is JSON. Ids increase by one and survive restarts.
struct StreamEvent {
  std::uint64_t id = 0;
  std::string type;  // "job", "tile", "worker"
  std::string data;
  // The job that a `job` or `tile` event is about. Empty: the event is not about a single job and is sent to
  // every reader
  std::string job;
  // Owner of that job; for a `worker` event: the owner of the job that the worker works on
  std::string owner = {};
};

struct SubmitRequest {
  std::string scene_name;  // name of the main file, for diagnostics
  std::string scene_text;  // Mitsuba or Nori XML
  // The files that the scene may name; their blobs must be in the store
  std::map<std::string, Digest> assets;
  JobSpec spec;
  std::string owner = {};  // the user who submits it: JobView::owner
  // Header `traceparent` of the user's request (common/trace/span.h); a malformed one is ignored
  std::string traceparent = {};
};
struct Rejected {
  Error error;
  std::vector<Diagnostic> diagnostics;
};
inline tl::unexpected<Rejected> rejected(Error error, std::vector<Diagnostic> diagnostics = {}) {
  return tl::unexpected(Rejected{std::move(error), std::move(diagnostics)});
}

// Write views; missing values are null.
std::string time_json(const TimeSplit& time);
std::string job_json(const JobView& job);
// returns {"jobs": [...], "total", "states": {NAME: number}, "owners"}
std::string jobs_json(const JobsPage& page);
std::string worker_json(const WorkerView& worker);
std::string workers_json(const std::vector<WorkerView>& workers);  // returns {"workers": [...]}
std::string video_json(const VideoView& video);
std::string tiles_json(const std::vector<TileView>& tiles);                // returns {"tiles": [...]}
std::string convergence_csv(const std::vector<ConvergencePoint>& points);  // starts with a header line

// The functions below return the data of events for clients. `state` of a tile is "leased", "folded" (a
// result was added to the image) or "free".
std::string tile_event_json(const JobId& job, TileIndex tile, const PixelRect& rect, std::string_view state,
                            std::uint64_t spp, std::string_view worker);
std::string worker_gone_json(const WorkerId& worker);
std::string job_removed_json(const JobId& job);  // the last `job` event of this job
// The last `job` event that this coordinator sends for the job: another coordinator continues the job
std::string job_moved_json(const JobId& job);

}  // namespace ls::coordinator
