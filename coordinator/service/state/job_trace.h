// The trace spans that the coordinator records for one job: the job from its submission to its end, the
// leases, and steps such as adding a result to the image or writing the final image. A job that is not traced
// has no JobTrace.
//
// The ids of the trace and of the job's span are derived from the job's record, and the id of a lease's span
// also from the lease's id. So another coordinator, or this one after a restart, continues the same trace.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/domain/effect.h"
#include "coordinator/store/jobs/job_store.h"
#include "util/protocol/messages.h"
#include "util/trace/tracer.h"

namespace ls::coordinator {

// The part of a JobTrace that is the same for all jobs of a coordinator
struct Tracing {
  std::shared_ptr<trace::Tracer> tracer;  // receives the spans; null: nothing is traced
  // The ids of all leases since this start of the coordinator begin with this text; the ids of earlier leases
  // do not.
  std::string lease_prefix;
};

class JobTrace {
 public:
  // Null if the job is not traced: there is no tracer, or the sampler leaves the job out.
  static std::unique_ptr<JobTrace> begin(const Tracing& tracing, const StoredJob& job);
  // Returns the ids of the job's trace and span, which other programs need to refer to the job. Works also
  // after the job's end. nullopt: the job is not traced.
  static std::optional<trace::SpanContext> context_of(const Tracing& tracing, const StoredJob& job);

  // Adds an event to the job's span. `name` is the change of the job, such as "running".
  void event(std::string name, TimePoint at);
  // Records a span for a step of the job, such as writing the final image.
  void step(const char* name, TimePoint begin, TimePoint end, trace::Attributes attributes = {},
            bool failed = false);

  // Begins the span of a lease. Returns the ids of its trace and span, which the worker gets with the lease.
  trace::SpanContext lease_begins(const Lease& lease, const WorkerId& worker, const std::string& worker_name,
                                  TimePoint now);
  // Records two spans for a result: its check, which began at `checked` and took `check_seconds`, and its
  // storing, which began after the check and ended at `now`. If `failed` is false, the result's unit leaves
  // all leases that contain it. If `failed` is true, the result could not be stored, and the unit stays in
  // these leases until units_freed() is called.
  void result(const UnitResult& result, const WorkerId& worker, TimePoint checked, double check_seconds,
              TimePoint now, bool failed);
  void units_freed(const UnitsFreed& freed, TimePoint now);
  void leases_end(TimePoint now);

  // Records the job's span, and before it the spans of the leases that have not ended. To be called when the
  // job ends.
  void end(const StoredJob& job, TimePoint now);
  // Begins another span of the job in the same trace; later steps are part of the new span. To be called when
  // a job that has ended is extended.
  void begin_again(const StoredJob& job, TimePoint now);

 private:
  using Unit = std::pair<TileIndex, RoundIndex>;
  struct OpenLease {
    std::string worker, worker_name;
    std::int64_t start_ns = 0;
    std::int64_t end_ns = 0;  // time of the lease's last result, in nanoseconds since 1970
    std::size_t left = 0;     // number of units without a result
    std::int64_t units = 0, results = 0, samples = 0;
    double core_seconds = 0;
    std::string lost;  // why units left the lease without a result of it; empty if no unit did so
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
  const std::string identity_;  // span ids are derived from it; no other job of any farm has the same text
  const std::optional<trace::SpanId> parent_;
  trace::SpanContext context_;
  std::int64_t start_ns_ = 0;
  bool ended_;
  std::vector<trace::SpanEvent> events_;
  std::uint32_t events_left_out_ = 0;
  std::map<LeaseId, OpenLease> leases_;
  int former_leases_ = 0;
  std::multimap<Unit, LeaseId> holders_;  // for each unit without a result: the leases that contain it
};

}  // namespace ls::coordinator
