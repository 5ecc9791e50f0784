// What the coordinator remembers of jobs besides their pixels. Two real ones: SQLite, and memory (`lightshaft
// render`). Thread-safe. What a put or add returned for survives kill -9 and power loss (SQLite).
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

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/base/id.h"
#include "common/job/settings.h"
#include "common/protocol/messages.h"
#include "coordinator/domain/job_state.h"
#include "coordinator/service.h"

namespace ls::coordinator {

// What a job came to; written when it ends, so that a restart need not read its partials.
struct JobTotals {
  double render_seconds = 0;  // first ray to last fold
  double core_seconds = 0;
  double load_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;
  double spp_done = 0;
  std::uint64_t units = 0;          // done
  std::uint64_t units_planned = 0;  // 0: as many
  Health health;
  TimeSplit time;                         // `render` is not kept here: it is core_seconds
  double began_unix = 0, ended_unix = 0;  // wall clock of the first ray and of the end; 0: not yet
  // As of the last checkpoint: ImageError::verdict and few_hits; nothing: there was none.
  std::string doubt;
  std::optional<std::uint64_t> few_hits;
  bool operator==(const JobTotals&) const = default;
};

struct StoredJob {
  JobId id;
  std::string name;   // scene file name
  std::string owner;  // user name; empty: the admin, and in records of earlier versions
  double submitted_unix = 0;
  Digest scene;  // blob
  RenderSettings settings;
  JobSpec spec;                      // as asked; spp as last extended
  std::optional<std::uint64_t> spp;  // resolved; nothing: until target or time
  std::vector<BlobRef> assets;
  std::vector<std::string> warnings;
  bool reference_same_seed = false;  // same_noise() of its reference
  std::vector<std::string> features_used, features_left_out;
  std::string needs;     // canonical JSON (common/scene/needs.h); empty in records of earlier versions
  std::string analysis;  // JSON: the parts of the renderer with reasons, and what was pruned; for the report
  JobState state = JobState::queued;
  std::optional<StopReason> stopped;
  std::string error;
  std::optional<Digest> numeric_class;
  std::string build;  // of the worker that the job was pinned with
  bool fake = false;  // that worker was a fake one, and so are all that may do its units
  JobTotals totals;
  // Workers that rendered wrong pixels, in records of earlier versions: now JobStore::barred().
  std::vector<WorkerId> distrusted;
  std::set<Digest> awaited;    // blobs that are missing or damaged: it is paused until they are here again
  std::uint64_t revision = 0;  // number of the change, where a store counts them (Redis)
  std::uint64_t fence = 0;     // number of its owner, where several coordinators share a store
  bool damaged = false;        // its record can't be read: id, `failed` and `error` are all that is known
  bool operator==(const StoredJob&) const = default;
};
std::string to_json(const StoredJob& job);
Result<StoredJob> parse_stored_job(std::string_view json);

struct LogLine {
  double unix_time = 0;
  std::string text;
};

// One that rendered wrong pixels, and what says so.
struct BarredWorker {
  WorkerId worker;
  std::string evidence;
  bool operator==(const BarredWorker&) const = default;
};

class JobStore {
 public:
  virtual ~JobStore() = default;
  virtual Result<void> put_job(const StoredJob& job) = 0;  // inserts or replaces
  // All of them, or none.
  virtual Result<void> put_jobs(std::span<const StoredJob> jobs) = 0;
  // In order of first put. One whose record is damaged comes as such, and keeps no other from coming.
  virtual Result<std::vector<StoredJob>> jobs() const = 0;
  // With its points and log; of an unknown one nothing is removed.
  virtual Result<void> remove_job(const JobId& job) { return remove_jobs({&job, 1}); }
  virtual Result<void> remove_jobs(std::span<const JobId> jobs) = 0;  // all of them, or none

  virtual Result<void> add_point(const JobId& job, const ConvergencePoint& point) = 0;
  // Of the point with these samples, in place of what was said of it before.
  virtual Result<void> set_truth(const JobId& job, double spp, const TrueFigures& truth) = 0;
  virtual Result<std::vector<ConvergencePoint>> points(const JobId& job) const = 0;
  virtual Result<void> remove_points(const JobId& job) = 0;  // their truths, too

  virtual Result<void> add_log(const JobId& job,
                               const LogLine& line) = 0;  // the oldest beyond kLogLinesKept go
  virtual Result<std::vector<LogLine>> log(const JobId& job) const = 0;

  // Kept for good, beyond the jobs that it was found by; of one that is known the first evidence stays.
  virtual Result<void> bar(const BarredWorker& worker) = 0;
  virtual Result<std::vector<BarredWorker>> barred() const = 0;

  // Adds `amount` to a named counter and returns its value before; durable. For ids that must never come
  // twice.
  virtual Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) = 0;

  virtual StoreStatus status() const { return {}; }

  // ---- of a store that several coordinators share ----
  struct Inherited {
    StoredJob job;
    std::string from;  // the coordinator that had it
  };
  struct Moved {
    std::vector<BarredWorker> barred;  // found by another one; to be heeded before the rest
    std::vector<JobId> lost;           // to another one: nothing of them is stored here any more
    std::vector<Inherited> inherited;  // from one that is gone; one that was lost before may be among them
  };
  virtual Moved moved() { return {}; }  // each is told once
  // Under which addresses this coordinator can be reached.
  virtual void announce(const std::string&, const std::string&) {}
  // Who has a job that this one does not know; may wait for a second. Nothing: nobody.
  virtual Result<std::optional<Elsewhere>> elsewhere(const JobId&) { return std::nullopt; }
};

Result<std::unique_ptr<JobStore>> open_sqlite_job_store(const std::filesystem::path& file);
std::unique_ptr<JobStore> make_memory_job_store();

}  // namespace ls::coordinator
