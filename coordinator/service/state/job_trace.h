// The trace spans that the coordinator records for one job: the job from its submission to its end, the
// leases (lists of units that are assigned to one worker), and steps such as adding a result to the image or
// writing the final image. A job that is not traced has no JobTrace.
//
// The ids of trace, job and leases are derived from the job's record and the lease's id, so that another
// coordinator, or this one after a restart, continues the same trace.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/protocol/messages.h"
#include "common/trace/tracer.h"
#include "coordinator/domain/effect.h"
#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {

// The tracer of jobs, and the prefix of the coordinator's leases
struct Tracing {
  std::shared_ptr<trace::Tracer> tracer;  // null: nothing is traced
  std::string lease_prefix;               // of the leases of this start of the coordinator
};

class JobTrace {
 public:
  // Null if the job is not traced: there is no tracer, or the sampler leaves the job out.
  static std::unique_ptr<JobTrace> begin(const Tracing& tracing, const StoredJob& job);
  // Returns the job's span for use by other programs, also after the job's end. nullopt: the job is not
  // traced.
  static std::optional<trace::SpanContext> context_of(const Tracing& tracing, const StoredJob& job);

  // Notes a change of the job, such as "running", on its span.
  void event(std::string name, TimePoint at);
  // Records a step of the job.
  void step(const char* name, TimePoint begin, TimePoint end, trace::Attributes attributes = {},
            bool failed = false);

  // A lease begins. Returns its context, which goes to the worker.
  trace::SpanContext lease_begins(const Lease& lease, const WorkerId& worker, const std::string& worker_name,
                                  TimePoint now);
  // Records how a result was handled: its check began at `checked` and took `check_seconds`; then it was
  // stored, until `now`. `failed`: it was not stored, and its unit stays in every lease that holds it until
  // units_freed().
  void result(const UnitResult& result, const WorkerId& worker, TimePoint checked, double check_seconds,
              TimePoint now, bool failed);
  void units_freed(const UnitsFreed& freed, TimePoint now);
  void leases_end(TimePoint now);

  // The job ends: its leases and its span are recorded.
  void end(const StoredJob& job, TimePoint now);
  // A job that has ended is extended: from here on its steps are part of another span of the same trace.
  void begin_again(const StoredJob& job, TimePoint now);

 private:
  using Unit = std::pair<TileIndex, RoundIndex>;
  struct OpenLease {
    std::string worker, worker_name;
    std::int64_t start_ns = 0;
    std::int64_t end_ns = 0;  // time of its last result
    std::size_t left = 0;     // units without a result
    std::int64_t units = 0, results = 0, samples = 0;
    double core_seconds = 0;
    std::string lost;  // why units left the lease without a result; empty if none did
  };
  JobTrace(const Tracing& tracing, const StoredJob& job, trace::SpanContext context,
           std::optional<trace::SpanId> parent);
  std::int64_t ns(TimePoint at) const;
  trace::SpanContext lease_context(const LeaseId& lease) const;
  void child(const char* name, const trace::SpanContext& parent, std::int64_t begin_ns, std::int64_t end_ns,
             trace::Attributes attributes, bool failed);
  void record_lease(const LeaseId& id, const OpenLease& lease, std::int64_t end_ns);
  void leave(const LeaseId& id, std::int64_t now_ns);

  const Tracing tracing_;
  const std::string job_;
  const std::string identity_;  // text that no other job has, not even a job of another farm
  const std::optional<trace::SpanId> parent_;
  trace::SpanContext context_;
  std::int64_t start_ns_ = 0;
  bool ended_;
  std::vector<trace::SpanEvent> events_;
  std::uint32_t events_left_out_ = 0;
  std::map<LeaseId, OpenLease> leases_;
  int former_leases_ = 0;
  std::multimap<Unit, LeaseId> holders_;  // the leases that each unit without a result is part of
};

}  // namespace ls::coordinator
