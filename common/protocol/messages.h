// Messages between coordinator and worker, as plain values. proto/farm.proto defines their form on the wire
// and documents the exchange; proto/convert.h converts between the two. `lightshaft render` passes these
// values inside one process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/digest.h"
#include "common/base/id.h"
#include "common/image/film/health.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"
#include "common/job/settings.h"
#include "common/job/techniques.h"
#include "common/trace/span.h"

namespace ls {

inline constexpr int kProtocolVersion = 1;

// A unit: the work of one render task, which is one round (range of samples) of one tile of a job. Rendering
// the same unit gives the same bits on every machine of one numeric class.
struct UnitKey {
  JobId job;
  TileIndex tile = 0;
  RoundIndex round = 0;
  auto operator<=>(const UnitKey&) const = default;
};

struct BlobRef {
  Digest digest;
  std::uint64_t bytes = 0;
  std::string name;  // the scene's name for the file; for messages only, never a path
  bool operator==(const BlobRef&) const = default;
};

// The data about a job that a worker needs. The coordinator sends them before the job's first lease on a
// connection.
struct JobBrief {
  JobId job;
  Digest scene;  // digest of the blob with the canonical scene (common/scene/json/serialize.h)
  RenderSettings settings;
  Digest settings_digest;
  std::vector<BlobRef> assets;  // assets that the scene uses
  // The features that the scene needs of the renderer, according to the coordinator
  // (common/scene/analysis/needs.h). The worker compares it with its own analysis. Empty: not sent.
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

// Units (one round of one tile each) that the coordinator has assigned to one worker until a deadline. The
// worker renders them in order and reports each result on its own.
struct Lease {
  LeaseId id;
  JobId job;
  std::vector<LeaseUnit> units;
  bool operator==(const Lease&) const = default;
};

// Seconds that a worker spent on a unit besides rendering it. `load` and `build` are the times until the
// job's world (the scene prepared for rendering) was ready; only the first result of a world has them. `load`
// is the time to fetch the job's files, `build` the wall-clock time in which one thread reads them and builds
// the world.
struct UnitTimes {
  double load = 0, build = 0;
  double transfer = 0;  // encoding the result and computing its digest
  double idle = 0;      // idle time of its thread since the previous unit of the job
  // Time its thread waited for a core while rendering: wall-clock seconds minus cpu_seconds
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
  TechniqueSet techniques;  // techniques that the integrator uses in this job's world; empty: unknown
  // When the worker received the unit, by its clock, in nanoseconds since 1970. It is sent only if the lease
  // has a trace; 0: not sent.
  std::uint64_t held_unix_ns = 0;
  bool operator==(const UnitResult&) const = default;
};

// A unit that could not be rendered. `scene_at_fault`: the world cannot be built from the scene, for example
// because a grid is truncated. Otherwise rendering failed (crash, hang, memory). In both cases other workers
// try the unit; the job fails after failures on several workers.
struct UnitFailure {
  UnitKey unit;
  LeaseId lease;
  bool scene_at_fault = false;
  std::string reason;                        // text for the user
  std::optional<int> signal;                 // signal that ended the render child
  std::optional<std::pair<int, int>> pixel;  // the pixel that was being rendered then
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
  // The id in an earlier Welcome; empty for a new worker. With it, a worker keeps its id when it connects
  // again.
  WorkerId previous_id;
  bool fake = false;     // true if the worker generates fake pixels instead of rendering
  std::string platform;  // machine and build of its numeric class in words; may be empty
  bool operator==(const WorkerHello&) const = default;
};
// Renews the deadlines of the given leases. The worker sends it about once a second while it has work.
struct WorkerProgress {
  struct Entry {
    LeaseId lease;
    std::uint32_t units_done = 0;
    bool operator==(const Entry&) const = default;
  };
  std::vector<Entry> leases;
  std::string activity;  // text for the dashboard: "loading bath.vdb", "rendering", "idle"
  double cpu_seconds_total = 0;
  std::uint64_t rss_bytes = 0;
  double load_seconds = 0;  // duration of the last build of a world
  bool operator==(const WorkerProgress&) const = default;
};
// The worker wants no more leases. It still delivers finished units, and returns the others by LeaseReturned.
struct WorkerDraining {
  bool operator==(const WorkerDraining&) const = default;
};
// Units of this lease that the worker has not rendered and will not render, because it drains
// (WorkerDraining), or because the units were cancelled.
struct LeaseReturned {
  LeaseId lease;
  std::vector<UnitKey> unrendered;
  bool operator==(const LeaseReturned&) const = default;
};
using FromWorker =
    std::variant<WorkerHello, WorkerProgress, UnitResult, UnitFailure, LeaseReturned, WorkerDraining>;

// Messages from coordinator to worker.
struct Welcome {
  WorkerId worker;
  // A number that grows with every registration of this worker. The coordinator closes the worker's
  // connections with smaller numbers.
  std::uint64_t epoch = 0;
  bool operator==(const Welcome&) const = default;
};
struct Refused {  // after this message the coordinator closes the connection
  Error error;
  bool retry = false;
  bool operator==(const Refused&) const = default;
};
struct AssignLease {
  Lease lease;
  std::optional<JobBrief> brief;  // sent with a job's first lease on this connection
  // The span of the lease in the job's trace, the parent of the worker's spans. nullopt: the lease is not
  // traced.
  std::optional<trace::SpanContext> trace = std::nullopt;
  bool operator==(const AssignLease&) const = default;
};
// The coordinator has stored the result durably, or rejected it with a reason. In both cases the worker
// deletes its copy.
struct ResultAck {
  UnitKey unit;
  std::optional<Error> refused;
  bool operator==(const ResultAck&) const = default;
};
// The worker stops rendering the job's units immediately; results of the job are dropped.
struct CancelJob {
  JobId job;
  bool operator==(const CancelJob&) const = default;
};
struct CancelLease {
  LeaseId lease;
  bool operator==(const CancelLease&) const = default;
};
struct DrainNow {
  bool operator==(const DrainNow&) const = default;
};
using ToWorker = std::variant<Welcome, Refused, AssignLease, ResultAck, CancelJob, CancelLease, DrainNow>;

}  // namespace ls
