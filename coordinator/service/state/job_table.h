// Jobs in the coordinator's memory, and sequences (jobs with frames); all are guarded by the service's mutex
// (service/core.h).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/assemble/assembly.h"
#include "coordinator/assemble/job_report.h"
#include "coordinator/domain/job_clock.h"
#include "coordinator/service/state/job_trace.h"
#include "coordinator/store/jobs/job_store.h"
#include "coordinator/store/log/partial_log.h"

namespace ls::coordinator {

struct Denoised;

class ImageWriter;
class JobTable;
class Publisher;

// Parts of a job in memory that one component alone reads and writes

class Snapshots {
 public:
  explicit Snapshots(TimePoint now) : last(now) {}

 private:
  friend ImageWriter;
  bool running = false;
  std::uint64_t committed = 0;  // used by the writer thread only
  TimePoint last;
};

class Published {
  friend Publisher;
  TimePoint at{};                     // of the last event about the job or sequence
  bool due = false;                   // true: its progress is to be published soon
  JobState state = JobState::queued;  // the state in that event
};

class InSequence {
  friend JobTable;
  JobState counted = JobState::queued;  // the state with which Sequence::in_state counts the frame
};

// A job in memory: its record (`stored`), its image, and what is known about it only while the coordinator
// runs.
struct JobEntry {
  JobEntry(StoredJob job, TimePoint now);

  void begin_image();       // creates an image without samples
  void begin_comparison();  // if the job has a reference image: creates reference_tiles from the image so far
  void free_image();        // frees the image and closes the log; only the job's record and its files remain
  // Seconds that the job's clock shows or, once its rendering has ended, showed last
  double elapsed(TimePoint now) const;

  StoredJob stored;  // the job's record; its state stays `running` until the final image is written
  Digest settings_digest;
  TileGrid grid;
  std::uint64_t film_bytes = 0;      // memory of the image's pixel sums when each tile has results
  std::shared_ptr<PartialLog> log;   // file of accepted results; null if all is in memory, or if `unloaded`
  std::optional<Assembly> assembly;  // the image in memory; nullopt if `unloaded`
  // Pictures for the comparison with the reference image; nullopt: the job has no reference image, or no
  // `assembly`
  std::optional<ReferenceTiles> reference_tiles;
  // Noise of the reference image, estimated by the latest comparison; nullopt: unknown
  std::optional<ReferenceNoise> reference_noise;
  // The denoised final image, until it is written; null: the job has no denoising, or the image is not
  // computed yet
  std::shared_ptr<const Denoised> denoised;
  std::vector<ConvergencePoint> points;
  // Number of the current convergence curve. The number rises when the curve is dropped because pixels were
  // wrong or lost. The result of a comparison with the reference image is ignored if it began for an older
  // curve.
  std::uint64_t curve = 0;
  // True if the job has ended (or could not be restored) and only its files and its record remain. The farm
  // does not know such a job.
  bool unloaded = false;
  // True if a user removed the job, or another coordinator owns it: nothing more is stored for it
  bool removed = false;
  // True while the numeric class that the job is pinned to is not stored yet. Until it is, no results of the
  // job are stored.
  bool pin_unsaved = false;
  // The job's open audits (units that are rendered again for comparison), as the text last written to disk
  // (store/log/audit_file.h)
  std::string audits;
  std::string broken;  // why the job could not be restored; empty: it could
  // Number of the request for the final image that is being made (ImageWriter::finish); 0: none is being made
  std::uint64_t finishing = 0;
  Snapshots snapshots;
  Published published;
  InSequence in_sequence;
  // Starts with the first result, and stands still during pauses. It has not started again once the job's
  // rendering has ended.
  JobClock clock;
  // Time at which the job's rendering ended, in seconds since 1970. Copied into `stored` when the job's end
  // is stored; for a done job this is after the final image is written.
  double ended_unix = 0;
  double fold_seconds = 0;    // seconds on the job's clock when a result was last added to the image
  std::string trouble;        // why the job does not continue, as a text for the user; empty: no problem
  std::uint64_t resumes = 0;  // how often a pause of the job was ended since the coordinator started
  // For each leased unit, the workers that it is leased to; for display
  std::map<std::pair<TileIndex, RoundIndex>, std::vector<WorkerId>> leased;
  // Only while a restart adds results to the image again: for the unit of each of these results, the seconds
  // on the job's clock when the result was stored
  std::map<std::pair<TileIndex, RoundIndex>, double> replay_at;
  std::unique_ptr<JobTrace> trace;  // null: the job is not traced
};
using EntryPtr = std::shared_ptr<JobEntry>;

struct Sequence {
  std::vector<EntryPtr> frames;       // in ascending order of frame numbers; never empty
  std::vector<std::string> warnings;  // the warnings of all frames, each text once
  Published published;
  // Number of frames in each state, kept by JobTable: a job that waits for a sequence may be one of
  // thousands, and looking at all frames for each of them would take long.
  std::array<std::size_t, static_cast<std::size_t>(JobState::cancelled) + 1> in_state{};
  // The state (for_others()) of which the jobs that wait for the whole sequence know
  std::optional<JobState> notified;

  FrameRange range() const;
  // The state as others wait for it: `failed` or `cancelled` as soon as one frame is
  JobState for_others() const;
};

// All jobs in memory. A frame of a sequence is a job of its own, named by frame_job(). A sequence is defined
// by the ids of its frames alone; nothing else about it is stored.
class JobTable {
 public:
  // `shared`: other coordinators use the same store and make ids, too.
  explicit JobTable(bool shared) : shared_(shared) {}

  EntryPtr find(const JobId& id) const;  // null if there is no such job
  Sequence* sequence(const JobId& id);   // null if there is no such sequence
  const Sequence* sequence(const JobId& id) const;
  // job() returns the job with this id, or an error if there is none; the id of a sequence is an error.
  // usable() also gives an error for a job that could not be restored at the start, which can only be
  // removed.
  Result<EntryPtr> job(const JobId& id) const;
  Result<EntryPtr> usable(const JobId& id) const;
  Result<std::vector<EntryPtr>> job_or_frames(const JobId& id) const;
  Result<std::string> owner(const JobId& id) const;
  const std::map<JobId, EntryPtr>& all() const { return jobs_; }
  std::map<JobId, Sequence>& sequences() { return sequences_; }
  // The ids of all jobs and sequences in order of submission. A sequence is listed with its own id only, not
  // with those of its frames.
  const std::vector<JobId>& order() const { return order_; }

  JobId unused_id() const;
  // Returns an error if there is no room for `jobs` more jobs.
  Result<void> room_for(const std::string& owner, std::size_t jobs) const;
  // Returns an error if the images of the jobs `more` do not fit into the memory for images: `in_all` bytes
  // for the jobs of all, and half of it for those of one user. A job counts until its image is in files. Of a
  // sequence the largest kFilmsOfSequence frames count, since few are rendered at the same time.
  Result<void> film_room_for(std::span<const StoredJob> more, std::uint64_t in_all) const;
  // Adds a job. If it is a frame, it joins its sequence, which is listed at the place of its first frame.
  void add(const EntryPtr& entry);
  // Must be called after each change of the state in the job's record.
  void count_state(JobEntry& entry);
  // Removes the id of a job or a sequence from order(). The job, or the sequence's frames, stay in the table
  // until remove().
  void unlist(const JobId& id);
  // Removes the job. Returns the id that is no longer in order(): the job's id, or the sequence's id if the
  // job was its last remaining frame. nullopt: other frames of the sequence remain, or unlist() was called
  // before.
  std::optional<JobId> remove(const EntryPtr& entry);

  // The jobs that wait for this job, frame or sequence (JobSpec::after)
  std::vector<EntryPtr> waiting_for(const JobId& id) const;
  // Sets what the job waits for. Only this function may change JobSpec::after of a job in the table.
  void set_after(JobEntry& entry, std::vector<std::string> after);

 private:
  std::map<JobId, std::set<JobId>> waiting_;  // by the job that others wait for
  const bool shared_;
  std::map<JobId, EntryPtr> jobs_;
  std::map<JobId, Sequence> sequences_;
  std::vector<JobId> order_;
};

// Returns the values for the job's report, except the digest of the pixels, which takes time to compute.
ReportFacts facts_of(const JobEntry& entry, TimePoint now);

}  // namespace ls::coordinator
