// Stores everything about jobs except their pixels, which are in the log of partials (store/log). There are
// two basic implementations: SQLite, and memory (for `lightshaft render`). A third, in store/redis, keeps the
// data in an SQLite store and copies them to Redis. Thread-safe. With SQLite, data survive kill -9 and power
// loss once a put or add has returned.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/domain/job_state.h"
#include "coordinator/views/views.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/id.h"
#include "core/image/frame/camera_matrices.h"
#include "core/job/meter_group.h"
#include "core/job/settings.h"
#include "core/job/techniques.h"
#include "util/protocol/messages.h"

namespace ls::coordinator {

// The state of a job store's mirror, which is a Redis server to which every change is copied
struct StoreStatus {
  std::string mirror;  // address of the mirror; empty: there is none
  // Why the mirror cannot be updated now; empty: updates succeed
  std::string trouble;
  std::uint64_t behind = 0;  // number of jobs whose latest data the mirror does not have yet
};

// The coordinator that owns a job, if several coordinators share a store
struct JobLocation {
  std::string http;  // http://HOST:PORT; empty: unknown
  // False: the coordinator is gone; another will take the job over, unless the job has ended
  bool alive = false;
};

// Totals of a job over all its units. They are written when the job ends, so that a restart does not have to
// read its partials (the encoded pixel sums of its units).
struct JobTotals {
  double render_seconds = 0;  // from the first ray until the last unit's sums were added to the image
  double core_seconds = 0;    // CPU time that workers spent on rendering
  double load_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;
  double spp_done = 0;
  std::uint64_t units = 0;          // number of units done
  std::uint64_t units_planned = 0;  // number of units that the job had planned; 0: as many as `units`
  Health health;
  TimeSplit time;  // time.render is unused: core_seconds above has this value
  // Times of the first ray and of the job's end, in seconds since 1970; 0: not yet
  double began_unix = 0, ended_unix = 0;
  // Why the image's error figures at the last checkpoint cannot be trusted (ImageError::verdict); empty: they
  // can, or there was no checkpoint yet
  std::string doubt;
  // Number of pixels in which too few samples had found light for a reliable error estimate at the last
  // checkpoint (ImageError::few_hits); nullopt: there was no checkpoint yet
  std::optional<std::uint64_t> few_hits;
  bool lit = true;  // false: no sample had found light at the last checkpoint (ImageError::lit)
  bool operator==(const JobTotals&) const = default;
};

struct StoredJob {
  JobId id;
  std::string name;             // name in lists: at first that of the scene file
  std::string scene_name = {};  // name of the scene file, if it is not `name`
  std::string owner;            // user name; empty: the administrator
  double submitted_unix = 0;
  // W3C `traceparent` of the span in which another program submitted the job; the job's spans belong to its
  // trace (util/trace/span.h). Empty: there is none
  std::string traceparent;
  Digest scene;  // digest of the scene's blob
  RenderSettings settings;
  JobSpec spec;  // the user's request; if the job was extended, spec.spp is the new number of samples
  // Samples per pixel to render; nullopt: an error target or a time limit ends the job.
  std::optional<std::uint64_t> spp;
  std::vector<BlobRef> assets;
  std::vector<MeterGroup> meters;  // what it measures, in the scene's order; empty: it makes an image
  std::vector<std::string> warnings;
  bool reference_same_seed = false;  // true: its reference image was rendered with this scene and seed
  std::vector<std::string> features_used, features_left_out;
  std::string needs;  // what the scene needs, as canonical JSON (core/scene/analysis/needs.h)
  // The camera of the image, for the header of the final EXR. nullopt: it has no such matrices, or an older
  // version stored the job.
  std::optional<CameraMatrices> camera = {};
  // JSON for the report: which features of the renderer the scene needs and why, and which parts of the scene
  // are not rendered and why
  std::string analysis;
  JobState state = JobState::queued;
  std::optional<StopReason> stopped;
  std::string error;
  std::optional<JobFailure> failure;  // `error` as data, if a unit could not be rendered
  std::optional<Digest> numeric_class;
  // `build` and `platform` describe the numeric class to which the job is pinned: the build of one of its
  // workers, and that worker's machine and build in words. Both are from its WorkerHello.
  std::string build, platform;
  bool fake = false;  // true if pinned to a fake worker; then only fake workers may render its units
  JobTotals totals;
  // Rendering techniques that workers use for this job, as they reported
  TechniqueSet techniques;
  // The checks of the denoised layers' error made so far, if the job's target error applies to these layers
  // (DenoisedTarget in domain/adaptive_stop.h). They decide when the job ends
  std::vector<DenoisedCheck> denoised_checks;
  std::optional<DenoisedFigure> denoised;  // of the final image, if it has denoised layers
  // Blobs that the job needs but that are missing or damaged; the job is paused until they are available
  std::set<Digest> missing_blobs;
  // Pixels whose tiles are rendered before the others (domain/event.h: JobPlan::focus)
  std::optional<PixelRect> focus;
  std::uint64_t revision = 0;  // number of changes of this record; only the Redis store counts them
  // Number of times the job has changed its owner, if several coordinators share a store (redis_members.h)
  std::uint64_t fence = 0;
  bool damaged = false;  // true if its record cannot be read: only id, state (failed) and error are set
  bool operator==(const StoredJob&) const = default;
};

// Returns the name of the job's scene file, for diagnostics and commands.
inline const std::string& scene_file_of(const StoredJob& job) {
  return job.scene_name.empty() ? job.name : job.scene_name;
}
std::string to_json(const StoredJob& job);
Result<StoredJob> parse_stored_job(std::string_view json);

struct LogLine {
  double unix_time = 0;
  std::string text;
};

std::string points_json(const std::vector<ConvergencePoint>& points);
Result<std::vector<ConvergencePoint>> parse_points(std::string_view json);
std::string log_json(const std::vector<LogLine>& lines);
Result<std::vector<LogLine>> parse_log(std::string_view json);
// Returns the lines as text, each with its time in UTC.
std::string log_text(std::span<const LogLine> lines);

// A worker that rendered wrong pixels, and the evidence for this as text
struct QuarantinedWorker {
  WorkerId worker;
  std::string evidence;
  bool operator==(const QuarantinedWorker&) const = default;
};

class JobStore {
 public:
  virtual ~JobStore() = default;
  // Inserts the jobs and replaces those that exist already. On an error, none of them is changed.
  Result<void> put_job(const StoredJob& job) { return put_jobs({&job, 1}); }
  virtual Result<void> put_jobs(std::span<const StoredJob> jobs) = 0;
  // Returns all jobs, in the order in which they were first put. A job whose record is damaged is returned
  // with `damaged` set; the other jobs are not affected.
  virtual Result<std::vector<StoredJob>> jobs() const = 0;
  // Removes the job with its points and log; succeeds if the job is unknown.
  Result<void> remove_job(const JobId& job) { return remove_jobs({&job, 1}); }
  virtual Result<void> remove_jobs(std::span<const JobId> jobs) = 0;  // removes all jobs or none

  virtual Result<void> add_point(const JobId& job, const ConvergencePoint& point) = 0;
  // Sets the reference error of the convergence point that has `spp` samples. It replaces an earlier value.
  virtual Result<void> set_reference_error(const JobId& job, double spp,
                                           const ReferenceError& reference_error) = 0;
  virtual Result<std::vector<ConvergencePoint>> points(const JobId& job) const = 0;
  virtual Result<void> remove_points(const JobId& job) = 0;  // also removes their reference errors

  // Adds a line to the job's log. If the log gets longer than kLogLinesKept lines, older lines may be
  // removed.
  virtual Result<void> add_log(const JobId& job, const LogLine& line) = 0;
  virtual Result<std::vector<LogLine>> log(const JobId& job) const = 0;

  // Stores that a worker is quarantined. The entry is permanent: it stays even if the jobs with the faulty
  // results are removed. If the worker is quarantined already, the evidence stored first stays.
  virtual Result<void> quarantine(const QuarantinedWorker& worker) = 0;
  virtual Result<std::vector<QuarantinedWorker>> quarantined() const = 0;

  // Durably adds `amount` to a named counter and returns the counter's previous value. Used to make ids that
  // must never repeat.
  virtual Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) = 0;

  virtual StoreStatus status() const { return {}; }

  // The rest is for a store that several coordinators share: each job is owned by one of them.

  // A job that this coordinator has taken over from one that is gone
  struct Inherited {
    StoredJob job;
    std::string from;  // the coordinator that owned the job before
  };
  struct Moved {
    // Workers that another coordinator has quarantined. The caller must apply them before it takes the jobs.
    std::vector<QuarantinedWorker> quarantined;
    // Jobs that another coordinator has taken over from this one; their updates are no longer stored here
    std::vector<JobId> lost;
    // Jobs that this coordinator has taken over from others. They may include jobs that it has lost before.
    std::vector<Inherited> inherited;
  };
  virtual Moved moved() { return {}; }  // returns what has changed since the last call
  // Sets the addresses at which this coordinator can be reached.
  virtual void announce(const std::string&, const std::string&) {}
  // Tells whether the other coordinators can be told of changes now. If not, returns `unavailable`: a change
  // that a user is told of could be lost when another coordinator takes the job over.
  virtual Result<void> can_share() const { return {}; }
  // Waits until the latest records of these jobs, or their removals, are where another coordinator that takes
  // the jobs over finds them; at most some seconds. `unavailable`: they are not, or not yet.
  virtual Result<void> share(std::span<const JobId>) { return {}; }
  // Finds the coordinator that owns a job which this one does not have; may block for a second. nullopt: no
  // coordinator owns the job.
  virtual Result<std::optional<JobLocation>> locate_job(const JobId&) { return std::nullopt; }
};

Result<std::unique_ptr<JobStore>> open_sqlite_job_store(const std::filesystem::path& file);
std::unique_ptr<JobStore> make_memory_job_store();

}  // namespace ls::coordinator
