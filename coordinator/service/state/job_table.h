// Jobs in the coordinator's memory, and sequences (jobs with frames); all are guarded by the service's mutex
// (service/core.h).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/assemble/assembly.h"
#include "coordinator/assemble/job_report.h"
#include "coordinator/service/state/job_trace.h"
#include "coordinator/store/jobs/job_store.h"
#include "coordinator/store/log/partial_log.h"

namespace ls::coordinator {

struct Denoised;

struct JobEntry {
  JobEntry(StoredJob job, TimePoint now);

  // Creates an image without samples, and the tiles for the comparison with the reference.
  void begin_image();
  void begin_comparison();  // only for a job that has a reference
  void free_image();        // afterwards only the job's record and its files are left
  // Seconds on the job's clock, which starts with the first ray and stands still during pauses
  double elapsed(TimePoint now) const;

  StoredJob stored;  // its state stays `running` until the final image is written
  Digest settings_digest;
  TileGrid grid;
  std::shared_ptr<PartialLog> log;   // file of accepted results; null if the job is only in memory
  std::optional<Assembly> assembly;  // the image; nullopt once an ended job is on disk
  // Pictures to compare with the reference, if it has one, while there is an assembly
  std::optional<ReferenceTiles> reference_tiles;
  // Noise of the reference image, estimated by the latest comparison; nullopt: unknown
  std::optional<ReferenceNoise> reference_noise;
  // The denoised final image, until it is written; null: the job has no denoising, or the image is not
  // computed yet
  std::shared_ptr<const Denoised> denoised;
  std::vector<ConvergencePoint> points;
  // Number of the current convergence curve; it rises when the curve is dropped because pixels were wrong or
  // lost. A comparison with the reference that began for an older curve and ends later is ignored
  std::uint64_t curve = 0;
  // True if it has ended and only its files and its record remain: the farm has forgotten it
  bool unloaded = false;
  // True if its user removed it, or another coordinator owns it: nothing more is stored for it
  bool removed = false;
  bool pin_unsaved = false;     // its numeric class is not stored yet, so its results cannot be stored either
  std::string audits;           // its open audits, as they were last written to disk (store/log/audit_file.h)
  std::string broken;           // why it could not be restored at the start
  std::uint64_t finishing = 0;  // number of the final image that is being made; 0: none
  bool snapshot_running = false;
  std::uint64_t snapshots = 0;  // number of snapshots committed; used by the writer thread only
  TimePoint last_snapshot{}, last_progress{};
  bool progress_due = false;
  JobState last_state = JobState::queued;  // the state that clients were last sent
  // When the job's clock stood at 0: the time of the first ray, moved later by pauses; nullopt while the
  // clock does not run
  std::optional<TimePoint> clock_zero;
  // When its clock stopped because the job was paused; nullopt: the clock is not stopped
  std::optional<TimePoint> still_since;
  // When its rendering ended, in seconds since 1970. The job's record gets this value when the end is stored
  double ended_unix = 0;
  double fold_seconds = 0;    // seconds on the job's clock when a result was last added to the image
  std::string trouble;        // why the job waits, for the user
  std::uint64_t resumes = 0;  // how often it was resumed
  // For each leased unit (tile and round), the workers that it is leased to; for display
  std::map<std::pair<TileIndex, RoundIndex>, std::vector<WorkerId>> leased;
  // For each durable result, the seconds on the job's clock when it was stored; set while a restart adds the
  // results to the image again
  std::map<std::pair<TileIndex, RoundIndex>, double> replay_at;
  std::unique_ptr<JobTrace> trace;  // null: the job is not traced
};
using EntryPtr = std::shared_ptr<JobEntry>;

struct Sequence {
  std::vector<EntryPtr> frames;       // ascending, never empty
  std::vector<std::string> warnings;  // of all frames, without duplicates
  TimePoint last_progress{};
  bool progress_due = false;

  FrameRange range() const;
};

// All jobs in memory. A frame of a sequence is a job of its own, named by frame_job(). A sequence is defined
// by the ids of its frames alone; nothing else about it is stored.
class JobTable {
 public:
  // `shared`: other coordinators use the same store and make ids, too.
  explicit JobTable(bool shared) : shared_(shared) {}

  EntryPtr find(const JobId& id) const;  // null if there is no such job
  Sequence* sequence(const JobId& id);   // null if there is no such sequence
  // Return the job, or an error: job() fails for a sequence, which is no job of its own; usable() also fails
  // for a job that could not be restored at the start. Such a job can only be removed.
  Result<EntryPtr> job(const JobId& id) const;
  Result<EntryPtr> usable(const JobId& id) const;
  Result<std::vector<EntryPtr>> job_or_frames(const JobId& id) const;
  Result<std::string> owner(const JobId& id) const;
  const std::map<JobId, EntryPtr>& all() const { return jobs_; }
  std::map<JobId, Sequence>& sequences() { return sequences_; }
  // In order of submission; a sequence appears once, not its frames
  const std::vector<JobId>& order() const { return order_; }

  JobId unused_id() const;
  // Returns an error if there is no room for `jobs` more jobs.
  Result<void> room_for(const std::string& owner, std::size_t jobs) const;
  // Adds a job. If it is a frame, it joins its sequence, which is listed at the place of its first frame.
  void add(const EntryPtr& entry);
  // Removes a job or a sequence from order(). Its jobs stay in the table until remove()
  void unlist(const JobId& id);
  // Removes the job. Returns the id that is no longer in order(): the job's, or the sequence's if the job was
  // its last frame.
  std::optional<JobId> remove(const EntryPtr& entry);

 private:
  const bool shared_;
  std::map<JobId, EntryPtr> jobs_;
  std::map<JobId, Sequence> sequences_;
  std::vector<JobId> order_;
};

// Returns all facts for the report except the digest of the pixels, which takes time.
ReportFacts facts_of(const JobEntry& entry, TimePoint now);

}  // namespace ls::coordinator
