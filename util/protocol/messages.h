// Messages between coordinator and worker, as plain values. proto/farm.proto defines their form on the wire
// and documents the exchange; proto/convert.h converts between the two. `lightshaft render` has coordinator
// and worker in one process and passes these values directly. Terms: docs/reference/glossary.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/digest.h"
#include "core/base/id.h"
#include "core/image/film/health.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"
#include "core/job/settings.h"
#include "core/job/techniques.h"
#include "util/trace/span.h"

namespace ls {

inline constexpr int kProtocolVersion = 1;

// A unit: the work of one render task, which is one round of one tile of a job. Rendering the same unit gives
// the same bits on every machine of one numeric class.
struct UnitKey {
  JobId job;
  TileIndex tile = 0;
  RoundIndex round = 0;
  auto operator<=>(const UnitKey&) const = default;
};

struct BlobRef {
  Digest digest;
  std::uint64_t bytes = 0;
  // Name of the file in the scene. Used in messages only, never as a path.
  std::string name;
  bool operator==(const BlobRef&) const = default;
};

// The data about a job that a worker needs. The coordinator sends them with a lease of the job if the worker
// does not remember them (BriefMemory, util/protocol/briefs.h).
struct JobBrief {
  JobId job;
  Digest scene;  // digest of the blob with the canonical scene (core/scene/json/serialize.h)
  RenderSettings settings;
  Digest settings_digest;
  std::vector<BlobRef> assets;  // assets that the scene uses
  // JSON text of the features that the scene needs of the renderer, as computed by the coordinator
  // (core/scene/analysis/needs.h). The worker compares it with the text that it computes itself. Empty: not
  // sent.
  std::string needs;
  bool operator==(const JobBrief&) const = default;
};

struct LeaseUnit {
  TileIndex tile = 0;
  RoundIndex round = 0;
  PixelRect rect;
  SampleRange samples;
  bool operator==(const LeaseUnit&) const = default;
};

// A lease: units that the coordinator has assigned to one worker until a deadline. The worker renders them in
// order and reports each result as soon as it has it.
struct Lease {
  LeaseId id;
  JobId job;
  std::vector<LeaseUnit> units;
  bool operator==(const Lease&) const = default;
};

// Times, in seconds, that a worker spent on a unit besides rendering it. Before its first unit of a job, a
// worker builds the job's world (the scene prepared for rendering). `load` is the time to fetch the job's
// files, `build` the wall-clock time in which one thread reads them and builds the world. Both are set only
// in the first result after the world was built; in all other results they are 0.
struct UnitTimes {
  double load = 0, build = 0;
  double transfer = 0;  // time to encode the result and compute its digest
  // Time that the rendering thread was idle since its previous unit of the job.
  double idle = 0;
  // Time that the rendering thread waited for a CPU core: the wall-clock time of rendering minus
  // UnitResult::cpu_seconds.
  double wait = 0;
  bool operator==(const UnitTimes&) const = default;
};

struct UnitResult {
  UnitKey unit;
  LeaseId lease;
  std::vector<std::byte> exr;  // the encoded partial: the pixel sums of the unit
  Digest digest;               // unit_digest() of the partial
  double cpu_seconds = 0;      // CPU time of the thread that rendered the unit
  Health health;
  UnitTimes times;
  TechniqueSet techniques;  // sampling techniques that the integrator uses in this job; empty: unknown
  // When the worker received the unit: nanoseconds since 1970 by the worker's clock. It is sent only if the
  // lease is traced (AssignLease::trace); 0: not sent.
  std::uint64_t held_unix_ns = 0;
  bool operator==(const UnitResult&) const = default;
};

// A unit that could not be rendered. `scene_at_fault`: true if the scene could not be prepared for rendering,
// for example because the file of a grid is truncated; false if rendering failed (crash, hang, out of
// memory). In both cases other workers try the unit. If it fails on several workers, the job fails.
struct UnitFailure {
  UnitKey unit;
  LeaseId lease;
  bool scene_at_fault = false;
  std::string reason;                        // text for the user
  std::optional<int> signal;                 // signal that ended the render process; nullopt: none
  std::optional<std::pair<int, int>> pixel;  // pixel (x, y) that was being rendered at the failure
  std::optional<std::uint64_t> sample;
  bool operator==(const UnitFailure&) const = default;
};

// Messages from worker to coordinator.
struct WorkerHello {
  int protocol = kProtocolVersion;
  std::string name;
  std::string build;
  Digest numeric_class;
  int threads = 1;
  std::uint64_t memory_bytes = 0;
  std::vector<std::string> tags;
  std::vector<Digest> blobs_held;
  std::string join_token;
  // The id that the worker got in an earlier Welcome, so that it keeps this id when it connects again; empty
  // for a new worker.
  WorkerId previous_id;
  bool fake = false;     // true if the worker generates fake pixels instead of rendering
  std::string platform;  // machine type and build that its numeric class stands for, as text; may be empty
  // The secret that came with previous_id; empty for a new worker. nullopt: the worker is of a version that
  // keeps no secret.
  std::optional<std::string> secret = std::nullopt;
  // Size of the BriefMemory (util/protocol/briefs.h) that the worker keeps; 0: every lease needs its brief
  std::uint64_t brief_bytes = 0;
  bool restarts = false;  // true if it can obey DrainNow::restart
  bool operator==(const WorkerHello&) const = default;
};
// This message renews the deadlines of the listed leases. The worker sends it about once a second while it
// has work.
struct WorkerProgress {
  struct Entry {
    LeaseId lease;
    std::uint32_t units_done = 0;
    bool operator==(const Entry&) const = default;
  };
  std::vector<Entry> leases;
  std::string activity;  // text for the dashboard, for example "loading bath.vdb", "rendering" or "idle"
  double cpu_seconds_total = 0;
  std::uint64_t rss_bytes = 0;
  double load_seconds = 0;  // seconds that the last preparation of a scene for rendering took
  bool operator==(const WorkerProgress&) const = default;
};
// The worker wants no more leases. It still sends the results of finished units, and returns all other units
// with a LeaseReturned message. `withdrawn`: it wants leases again, after a DrainNow that was withdrawn.
// `restarts`: afterwards it restarts its program. `refused`: why it does not, although it was asked to; it
// then goes on as `withdrawn` says.
struct WorkerDraining {
  bool withdrawn = false, restarts = false;
  std::string refused = {};
  bool operator==(const WorkerDraining&) const = default;
};
// The worker returns units of a lease that it has not rendered and will not render, because it takes no more
// work (WorkerDraining), does not know their job, cannot load it on this machine, or because the coordinator
// recalled the lease.
struct LeaseReturned {
  LeaseId lease;
  std::vector<UnitKey> unrendered;
  std::string reason = {};   // why, for the user; empty: not told
  bool unknown_job = false;  // true: the worker does not remember the job's brief
  bool operator==(const LeaseReturned&) const = default;
};
using FromWorker =
    std::variant<WorkerHello, WorkerProgress, UnitResult, UnitFailure, LeaseReturned, WorkerDraining>;

// Messages from coordinator to worker.
struct Welcome {
  WorkerId worker;
  // The number of this registration. Each time the worker registers, it gets a larger number, and the
  // coordinator closes the worker's connections that have smaller ones.
  std::uint64_t epoch = 0;
  // Proves that the worker has this id when it connects again (WorkerHello::secret)
  std::string secret = {};
  bool operator==(const Welcome&) const = default;
};
struct Refused {  // after this message the coordinator closes the connection
  Error error;
  bool retry = false;
  bool operator==(const Refused&) const = default;
};
struct AssignLease {
  Lease lease;
  std::optional<JobBrief> brief;  // nullopt: the worker remembers it
  // The span (traced period of time) of the lease in the job's trace. The worker's own spans become its
  // children. nullopt: the lease is not traced.
  std::optional<trace::SpanContext> trace = std::nullopt;
  bool operator==(const AssignLease&) const = default;
};
// The coordinator has stored the result of the unit durably, or has rejected it for the reason `refused`. In
// both cases the worker deletes its copy of the result.
struct ResultAck {
  UnitKey unit;
  std::optional<Error> refused;
  bool operator==(const ResultAck&) const = default;
};
// The job was cancelled. The worker stops rendering its units immediately and discards its results.
struct CancelJob {
  JobId job;
  bool operator==(const CancelJob&) const = default;
};
struct CancelLease {
  LeaseId lease;
  bool operator==(const CancelLease&) const = default;
};
// The worker gives back, in a LeaseReturned message, the units of this lease that it has not begun. It
// finishes the others. It sends nothing if it has begun all of them or does not hold the lease.
struct RecallLease {
  LeaseId lease;
  bool operator==(const RecallLease&) const = default;
};
// The worker finishes the units that are being rendered, returns the others, and ends. `withdrawn`: an
// earlier DrainNow no longer applies; the worker takes leases again unless it has another reason to end.
// `restart`: instead of ending, the worker restarts its program (WorkerHello::restarts).
struct DrainNow {
  bool withdrawn = false, restart = false;
  bool operator==(const DrainNow&) const = default;
};
using ToWorker =
    std::variant<Welcome, Refused, AssignLease, ResultAck, CancelJob, CancelLease, RecallLease, DrainNow>;

}  // namespace ls
