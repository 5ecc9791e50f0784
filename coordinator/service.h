// The coordinator without sockets: domain, store and assembler behind one thread-safe object. rpc/ and http/
// put it on the network; `lightshaft render` uses it in process.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/base/frame_range.h"
#include "common/base/id.h"
#include "common/image/convergence.h"
#include "common/image/reference.h"
#include "common/job/health_notes.h"
#include "common/protocol/messages.h"
#include "common/scene/diagnostic.h"
#include "common/scene/read.h"
#include "coordinator/domain/farm_figures.h"
#include "coordinator/domain/figures.h"
#include "coordinator/domain/job_state.h"
#include "coordinator/domain/time_split.h"

namespace ls::coordinator {

inline constexpr int kMoreWorkers = 8;  // of JobView::eta_with_more

struct ErrorFigures {  // of the image as folded up to one complete round over all tiles
  double rmse = 0;
  double relmse = 0;
  double relmse_lo = 0, relmse_hi = 0;  // 95 % intervals for the realised error
  double rmse_lo = 0, rmse_hi = 0;      // both 0: not known, of a version that did not store them
};
struct TrueFigures {  // against a reference, its own noise subtracted (common/image/reference.h)
  double rmse = 0, relmse = 0;
  std::optional<double> flip;  // mean HDR-FLIP (common/image/flip.h); at doubling samples only
  std::optional<double> mse_stderr = {}, relmse_stderr = {};
  // Less than the reference's own noise lets one tell: what is shown in the place of the figure.
  bool rmse_below_noise() const { return below_noise(rmse * rmse, mse_stderr); }
  bool relmse_below_noise() const { return below_noise(relmse, relmse_stderr); }
  bool operator==(const TrueFigures&) const = default;
};
struct ConvergencePoint {
  double seconds = 0;       // since the first ray
  double core_seconds = 0;  // CPU time of workers
  double spp = 0;
  ErrorFigures error;
  // Nothing: the job has no reference, or the figures are still being computed, or the checkpoint was in the
  // making while the coordinator restarted.
  std::optional<TrueFigures> truth = {};
};

// ---- sequences: a job with frames. Every frame is a job, too, with an id made of both ----
struct FrameId {
  JobId sequence;
  std::uint32_t frame = 0;
};
JobId frame_job(const JobId& sequence, std::uint32_t frame);  // "j-7f3a91c2-frame12"
std::optional<FrameId> frame_of(const JobId& job);            // nothing: the job is no frame

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
  std::uint32_t current = 0;   // the frame to look at: the first that is being rendered, or has been
  std::vector<FrameView> all;  // ascending; only in Coordinator::job()
};

struct JobView {
  JobId id;
  std::string name;   // scene file name, for people
  std::string owner;  // user whose token handed it in; empty: the admin, or from before there were users
  JobState state = JobState::queued;
  std::string stopped;                 // "spp", "error", "time", "user" once done
  double progress = 0;                 // 0..1
  std::uint64_t spp = 0;               // asked, or the most that any job gets
  bool spp_asked = true;               // false: its target or its time ends it
  std::optional<double> target_error;  // relMSE, asked
  double spp_done = 0;                 // mean over pixels
  std::optional<ErrorFigures> error_now;
  std::optional<TrueFigures> truth;                     // as of the last checkpoint that has it
  bool reference_same_seed = false;                     // truth says nothing: see same_noise() there
  std::optional<Judgement> judgement;                   // nothing: no sample yet
  std::optional<std::uint64_t> few_hits;                // pixels of the image as it is
  std::optional<Trend> trend;                           // nothing: too few checkpoints
  std::optional<double> efficiency;                     // 1 / (relMSE x core seconds) at the last checkpoint
  std::optional<std::uint64_t> pixels_without_samples;  // of the image as it is; nothing: not known
  std::optional<double> eta_seconds;
  std::optional<std::pair<double, double>> eta_ci95;  // where it is an error target that ends the job
  std::optional<double> eta_with_more;                // with kMoreWorkers more workers like those there are
  std::optional<std::pair<double, double>> eta_with_more_ci95;  // as eta_ci95
  std::string error;                                            // why it failed
  std::vector<std::string> warnings;                            // of the scene
  FrameSize size;
  int tile = 32;
  int priority = 0;
  std::optional<std::uint32_t> max_workers, max_units;  // asked
  std::uint64_t memory_bytes = 0;                       // that a worker must have, at least
  std::uint64_t units_done = 0, units_total = 0;
  double queued_core_seconds = 0;  // predicted for units that wait for a worker; 0: nothing measured yet
  double elapsed_seconds = 0, core_seconds = 0;
  TimeSplit time;
  double submitted_unix = 0;      // wall clock, for people
  Health health;                  // of what is folded; of a sequence its totals alone
  std::vector<HealthNote> notes;  // the same for people; none: all is well
  bool fake = false;              // fake workers make its pixels up; of a sequence those of any frame
  // Of a sequence; its other figures are those of all frames together: sums, means over pixels, and
  // elapsed_seconds from the first ray of any frame to the last fold.
  std::optional<FramesView> frames;
};

// What a user wants changed of a job: all of it or, when something is refused, nothing.
struct JobChange {
  std::optional<JobState> state;  // paused, running or cancelled
  std::optional<int> priority;
  std::optional<std::uint64_t> spp;  // the new total
  std::optional<double>
      target_error;  // of a job that has one and was not stopped otherwise; a smaller one goes on
};

struct TileView {
  TileIndex tile = 0;
  PixelRect rect;
  RoundIndex rounds_folded = 0;
  std::uint64_t spp = 0;
  std::optional<double> relmse;      // estimated; nothing: no sample yet
  std::vector<std::string> workers;  // names of those rendering it now
};

struct WorkerView {
  WorkerId id;
  std::string name;
  std::string build;
  Digest numeric_class;
  bool fake = false;  // it renders nothing and makes its pixels up
  int threads = 1;
  std::vector<std::string> tags;
  std::string state;     // "connected", "draining", "lost", "sick"
  std::string activity;  // what it said last
  std::string job;       // that it works on; may be empty
  std::uint64_t units_done = 0;
  double cpu_seconds = 0;
  std::uint64_t rss_bytes = 0;
  std::uint64_t memory_bytes = 0;  // that it may use; 0: not told
  double last_seen_seconds = 0;    // ago
};

// A thing that happened, as the event stream tells it. `data` is JSON. Ids grow by one and survive restarts.
struct StreamEvent {
  std::uint64_t id = 0;
  std::string type;  // "job", "tile", "worker"
  std::string data;
  std::string
      job;  // id of the job that a `job` or `tile` event is about; empty: of no one job, told to every reader
  std::string owner = {};  // of that job; of a `worker` event that of the job it works on
};

struct SubmitRequest {
  std::string scene_name;                // of the main file, for diagnostics
  std::string scene_text;                // Mitsuba or Nori XML
  std::map<std::string, Digest> assets;  // the files it may name; their blobs must be in the store
  JobSpec spec;
  std::string owner = {};  // JobView::owner
};
struct Rejected {
  Error error;
  std::vector<Diagnostic> diagnostics;
};

// Where messages to one worker go. Called from any thread; must not block and must not call back.
class WorkerSink {
 public:
  virtual ~WorkerSink() = default;
  virtual void send(ToWorker message) = 0;
  virtual void close() = 0;
};

// One registered stream. After disconnected() nothing more is sent to its sink.
class WorkerSession {
 public:
  virtual ~WorkerSession() = default;
  virtual void receive(FromWorker message) = 0;
  // The same without waiting: `next` is called when there is room for another message, at once or later on
  // another thread; never, if the coordinator closes first.
  virtual void receive(FromWorker message, std::function<void()> next) {
    receive(std::move(message));
    next();
  }
  virtual void disconnected() = 0;
};

// Bytes by digest. put() verifies; a blob is visible only when complete. What is damaged is never read: see
// prove().
class BlobStore {
 public:
  virtual ~BlobStore() = default;
  virtual bool has(const Digest& digest) const = 0;
  // The same, where it matters why not: an error says that it cannot be found out now.
  virtual Result<bool> find(const Digest& digest) const { return has(digest); }
  // Whether the place where they are kept answers, asked once; may take seconds.
  virtual Result<void> answers() const { return {}; }
  // That it is there with the bytes of its digest: read once in a process and when its file has changed
  // since, or, if a reader has found it wrong, `again`. not_found; failed_precondition: it was damaged, is
  // out of the way now and counts as missing.
  virtual Result<void> prove(const Digest& digest, [[maybe_unused]] bool again = false) const {
    return has(digest) ? Result<void>()
                       : fail(Errc::not_found, std::string("there is no blob ").append(digest.hex()));
  }
  virtual Result<std::uint64_t> size(const Digest& digest) const = 0;
  virtual Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                              std::uint64_t length) const = 0;
  virtual Result<void> put(const Digest& digest, std::span<const std::byte> bytes) = 0;
  // Streaming upload: append in order, finish() verifies the digest; abandoned ones leave nothing behind.
  class Upload {
   public:
    virtual ~Upload() = default;
    virtual Result<void> append(std::span<const std::byte> bytes) = 0;
    virtual Result<void> finish() = 0;
  };
  virtual Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) = 0;

  // ---- uploads in parts ----
  // How many bytes are kept of a blob that is not complete.
  virtual std::uint64_t received(const Digest&) const { return 0; }
  // Goes on behind those; failed_precondition: `offset` is not received(). What has been appended stays when
  // the upload is destroyed before finish(), also over restarts. From now on an earlier upload in parts of
  // the same blob is refused: its connection has broken, and only nobody noticed yet.
  virtual Result<std::unique_ptr<Upload>> resume_upload(const Digest&, std::uint64_t) {
    return fail(Errc::unavailable, "this store takes no uploads in parts");
  }

  // ---- collection of what nobody needs ----
  // All there is: blobs, or (unfinished) what is kept of incomplete ones.
  virtual Result<std::vector<Digest>> list(bool) const { return std::vector<Digest>{}; }
  virtual Result<void> remove(const Digest&) { return {}; }
  virtual void remove_unfinished(const Digest&) {}
};

// Of a store of jobs that tells another one (Redis) what it keeps.
struct StoreStatus {
  std::string mirror;        // its address; empty: there is none
  std::string trouble;       // why it cannot be told now; empty: it can
  std::uint64_t behind = 0;  // jobs of which it has not been told all
};

// The coordinator that has a job, of those that share a store.
struct Elsewhere {
  std::string http;    // http://HOST:PORT; empty: not known
  bool alive = false;  // false: the job will be taken over, or has ended there
};

// Whether --store can be taken: sqlite, or a redis:// address.
Result<void> check_store(const std::string& store);
// Whether --blobs can be taken: a folder, or an s3:// address with keys in the environment.
Result<void> check_blobs(const std::string& where);

// Whether a worker that shows this token may join. Any thread; must not block.
using JoinCheck = std::function<bool(std::string_view token)>;
// Of one token; an empty one lets every worker in.
JoinCheck join_check(std::string token);

class JobStore;  // store/job_store.h

class Coordinator {
 public:
  struct Options {
    std::filesystem::path data;    // empty: everything in memory, nothing survives (`lightshaft render`)
    std::string store = "sqlite";  // where jobs are kept: sqlite, or a redis:// address (store/redis_link.h)
    std::shared_ptr<JobStore> jobs;    // given for tests; otherwise made as `store` says
    std::shared_ptr<BlobStore> blobs;  // given for in-memory use; otherwise made as `blobs_at` says
    std::string blobs_at;              // empty: under `data`; else a folder, or an s3:// address
    // How long a blob stays that no job needs and nobody asks for, and an unfinished upload that does not
    // grow; nothing: blobs for good, unfinished uploads for a day.
    std::optional<Duration> keep_unused = std::chrono::hours(24);
    bool shared = false;      // other coordinators have the same store and blobs
    std::string join_token;   // empty: any worker may join
    JoinCheck may_join;       // given: asked instead
    bool allow_fake = false;  // workers that make their pixels up may join
    ShareLimits limits;
    double audit_rate = 0.01;  // share of the results that another worker renders again
    std::shared_ptr<const Clock> clock;
    std::optional<Duration>
        tick;  // how often Tick events are raised by an own thread; nothing: the caller calls tick()
  };
  static Result<std::unique_ptr<Coordinator>> open(Options options);
  virtual ~Coordinator() = default;

  // ---- jobs ----
  // With spec.frames the id is of the sequence. What changes or tells of a job takes it, too; what belongs to
  // one image takes frame_job() of it.
  virtual tl::expected<JobId, Rejected> submit(SubmitRequest request) = 0;
  virtual std::vector<JobView> jobs() const = 0;  // a sequence is one of them, its frames are not
  virtual Result<JobView> job(const JobId& id) const = 0;
  virtual Result<std::string> owner(const JobId& id) const {  // JobView::owner, for less
    const auto view = job(id);
    if (!view) return tl::unexpected(view.error());
    return view->owner;
  }
  virtual Result<void> change(const JobId& id, const JobChange& change) = 0;
  // A job that has ended goes with all that was rendered of it; one that has not is cancelled, and stays.
  virtual Result<void> remove(const JobId& id) = 0;
  virtual Result<void> cancel(const JobId& id) = 0;
  virtual Result<void> pause(const JobId& id) = 0;
  virtual Result<void> resume(const JobId& id) = 0;
  virtual Result<void> set_priority(const JobId& id, int priority) = 0;
  virtual Result<void> extend(const JobId& id, std::uint64_t spp) = 0;          // to this new total
  virtual Result<std::vector<std::byte>> image_exr(const JobId& id) const = 0;  // as it is now, or final
  virtual Result<std::vector<std::byte>> image_png(const JobId& id, double exposure) const = 0;
  // False-colour maps of the error and of the samples (common/image/maps.h).
  virtual Result<std::vector<std::byte>> error_png(const JobId& id) const = 0;
  virtual Result<std::vector<std::byte>> samples_png(const JobId& id) const = 0;
  virtual Result<std::string> report_json(const JobId& id) const = 0;
  virtual Result<std::vector<ConvergencePoint>> convergence(const JobId& id) const = 0;
  // Where `name` (image.exr, report.json) of a job that is done lies on the disk; empty: it does not, ask for
  // it.
  virtual std::filesystem::path final_file(const JobId&, const std::string&) const { return {}; }
  virtual Result<std::vector<TileView>> tiles(const JobId& id) const = 0;
  virtual Result<std::string> job_log(const JobId& id) const = 0;
  virtual Result<void> wait(const JobId& id) const = 0;  // until it is done, failed or cancelled

  // ---- workers ----
  virtual std::vector<WorkerView> workers() const = 0;
  virtual Result<std::unique_ptr<WorkerSession>> connect(const WorkerHello& hello,
                                                         std::shared_ptr<WorkerSink> sink) = 0;

  // ---- events ----
  // Calls back (any thread, in order) for every event after `after_id` that is still kept, then live. The
  // subscription ends when the returned handle is destroyed. A reader that can't keep up must drop by itself.
  virtual std::shared_ptr<void> subscribe(std::uint64_t after_id,
                                          std::function<void(const StreamEvent&)> on_event) = 0;
  virtual std::uint64_t last_event_id() const = 0;

  virtual BlobStore& blobs() = 0;
  virtual bool ready(std::string* why_not) const = 0;
  virtual StoreStatus store_status() const { return {}; }

  // ---- other coordinators, with Options::shared ----
  // Where they, workers and clients reach this one: http://HOST:PORT and HOST:PORT.
  virtual void announce(const std::string&, const std::string&) {}
  // Who has a job that this one does not know; may wait for a second. Nothing: nobody.
  virtual Result<std::optional<Elsewhere>> elsewhere(const JobId&) { return std::nullopt; }
  virtual AuditFigures audits() const { return {}; }
  virtual FarmFigures figures() const { return {}; }
  // A worker asked for a blob that is not here, or was damaged: the jobs that need it wait until it is here
  // again.
  virtual void blob_lacking(const Digest&, const Error&) {}
  virtual void blob_sent(std::uint64_t bytes) { static_cast<void>(bytes); }  // to a worker: to be counted
  virtual void tick() = 0;
  // Removes blobs that no job needs, and unfinished uploads, whose time is over (Options::keep_unused). With
  // Options::tick the coordinator does it by itself.
  virtual void collect() {}
};

}  // namespace ls::coordinator
