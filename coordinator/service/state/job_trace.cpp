// JobTrace: records the trace spans of one job, of its leases, and of steps such as storing a result. Terms:
// docs/reference/glossary.md.
#include "coordinator/service/state/job_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ls::coordinator {
namespace {

constexpr std::size_t kMaxEvents = 128;  // a job's span keeps at most this many events
constexpr int kMaxFormerLeases = 4096;

std::int64_t to_ns(double unix_seconds) {
  return static_cast<std::int64_t>(std::llround(std::clamp(unix_seconds, 0., 9e9) * 1e9));
}

// Returns a text that identifies the job within its trace. The job's id alone does not suffice: two farms
// that take part in one trace may each have a job of this id.
std::string identity_of(const StoredJob& job) {
  return fmt::format("job {} {} {}", job.id.value, job.submitted_unix, job.scene.hex());
}

// Returns the id of the job's span. `ended_unix`: time at which the job ended before it was extended; 0: it
// has not been extended. So a job that is extended after its end gets another span.
trace::SpanId span_of(const trace::TraceId& trace, const StoredJob& job, double ended_unix) {
  return span_id_of(trace, fmt::format("{} {}", identity_of(job), ended_unix));
}

struct Origin {
  trace::TraceId trace;
  std::optional<trace::SpanContext> parent;  // the request's span in the program that submitted the job
};

Origin origin_of(const StoredJob& job) {
  const auto parent = trace::parse_traceparent(job.traceparent);
  if (parent) return {parent->trace, parent};
  return {trace::trace_id_of("lightshaft " + identity_of(job)), std::nullopt};
}

bool taken(const Tracing& tracing, const Origin& origin) {
  return tracing.tracer &&
         tracing.tracer->sampler().takes(
             origin.trace, origin.parent ? std::optional(origin.parent->sampled) : std::nullopt);
}

std::int64_t samples_of(const LeaseUnit& unit) {
  return static_cast<std::int64_t>(unit.samples.s1 - unit.samples.s0) * unit.rect.pixels();
}

}  // namespace

std::unique_ptr<JobTrace> JobTrace::begin(const Tracing& tracing, const StoredJob& job) {
  if (!tracing.tracer) return nullptr;
  const Origin origin = origin_of(job);
  if (!taken(tracing, origin)) return nullptr;
  const trace::SpanContext context{origin.trace, span_of(origin.trace, job, job.totals.ended_unix), true};
  return std::unique_ptr<JobTrace>(
      new JobTrace(tracing, job, context, origin.parent ? std::optional(origin.parent->span) : std::nullopt));
}

std::optional<trace::SpanContext> JobTrace::context_of(const Tracing& tracing, const StoredJob& job) {
  if (!tracing.tracer) return std::nullopt;
  const Origin origin = origin_of(job);
  if (!taken(tracing, origin)) return std::nullopt;
  return trace::SpanContext{origin.trace, span_of(origin.trace, job, 0), true};
}

JobTrace::JobTrace(const Tracing& tracing, const StoredJob& job, trace::SpanContext context,
                   std::optional<trace::SpanId> parent)
    : tracing_(tracing),
      job_(job.id.value),
      identity_(identity_of(job)),
      parent_(parent),
      context_(context),
      start_ns_(to_ns(std::max(job.submitted_unix, job.totals.ended_unix))),
      ended_(is_terminal(job.state)) {}

// Converts a time to nanoseconds since 1970, but returns at least the start of the job's span. The start may
// have been measured by another machine's clock, which may be ahead of this one's.
std::int64_t JobTrace::ns(TimePoint at) const { return std::max(tracing_.tracer->unix_ns(at), start_ns_); }

void JobTrace::event(std::string name, TimePoint at) {
  if (events_.size() < kMaxEvents)
    events_.push_back({ns(at), std::move(name)});
  else
    ++events_left_out_;
}

void JobTrace::child(const char* name, const trace::SpanContext& parent, std::int64_t begin_ns,
                     std::int64_t end_ns, trace::Attributes attributes, bool failed) {
  attributes.emplace_back("lightshaft.job", job_);
  tracing_.tracer->record({.context = {context_.trace, tracing_.tracer->new_span_id(), true},
                           .parent = parent.span,
                           .name = name,
                           .start_ns = begin_ns,
                           .end_ns = std::max(begin_ns, end_ns),
                           .attributes = std::move(attributes),
                           .failed = failed});
}

void JobTrace::step(const char* name, TimePoint begin, TimePoint end, trace::Attributes attributes,
                    bool failed) {
  child(name, context_, ns(begin), ns(end), std::move(attributes), failed);
}

// Leases

trace::SpanContext JobTrace::lease_context(const LeaseId& lease) const {
  return {context_.trace, span_id_of(context_.trace, fmt::format("{} lease {}", identity_, lease.value)),
          true};
}

trace::SpanContext JobTrace::lease_begins(const Lease& lease, const WorkerId& worker,
                                          const std::string& worker_name, TimePoint now) {
  OpenLease open{.worker = worker.value, .worker_name = worker_name, .start_ns = ns(now)};
  open.left = lease.units.size();
  open.units = static_cast<std::int64_t>(open.left);
  for (const LeaseUnit& unit : lease.units) {
    open.samples += samples_of(unit);
    holders_.emplace(Unit{unit.tile, unit.round}, lease.id);
  }
  leases_.insert_or_assign(lease.id, std::move(open));
  return lease_context(lease.id);
}

void JobTrace::result(const UnitResult& r, const WorkerId& worker, TimePoint checked, double check_seconds,
                      TimePoint now, bool failed) {
  const Unit unit{r.unit.tile, r.unit.round};
  const std::int64_t now_ns = ns(now), stored_ns = ns(checked + from_seconds(check_seconds));
  const auto held_ns =
      static_cast<std::int64_t>(std::min<std::uint64_t>(r.held_unix_ns, static_cast<std::uint64_t>(now_ns)));
  auto open = leases_.find(r.lease);
  if (open == leases_.end() && !r.lease.value.starts_with(tracing_.lease_prefix + "-")) {
    // An earlier process of the coordinator granted this lease and ended before it recorded the lease's span.
    // At most kMaxFormerLeases such leases are recorded, since a lying worker can name any lease.
    if (former_leases_ >= kMaxFormerLeases) return;
    ++former_leases_;
    OpenLease former{.worker = worker.value, .start_ns = held_ns > 0 ? held_ns : ns(checked)};
    open = leases_.emplace(r.lease, std::move(former)).first;
  }
  // If a lying worker names another worker's lease, the result is not counted for that lease.
  const bool foreign = open != leases_.end() && open->second.worker != worker.value;
  if (open != leases_.end() && !foreign) {
    // The worker may have had the unit before this lease began: under an earlier lease, which ended when the
    // worker's connection broke. The span then starts at that earlier time.
    if (held_ns > 0) open->second.start_ns = std::min(open->second.start_ns, held_ns);
    open->second.start_ns = std::max(open->second.start_ns, start_ns_);
    open->second.end_ns = now_ns;
    ++open->second.results;
    open->second.core_seconds += r.cpu_seconds;
  }
  const auto attributes = [&] {
    return trace::Attributes{{"lightshaft.tile", std::int64_t{unit.first}},
                             {"lightshaft.round", std::int64_t{unit.second}},
                             {"lightshaft.bytes", static_cast<std::int64_t>(r.exr.size())}};
  };
  const trace::SpanContext parent = foreign ? context_ : lease_context(r.lease);
  child("check partial", parent, ns(checked), stored_ns, attributes(), failed);
  child("store partial", parent, stored_ns, now_ns, attributes(), failed);
  if (failed) return;
  // The unit is done, so it is removed from all leases that contain it.
  const auto [first, last] = holders_.equal_range(unit);
  std::vector<LeaseId> held;
  for (auto it = first; it != last; ++it) held.push_back(it->second);
  holders_.erase(first, last);
  for (const LeaseId& id : held) {
    if (const auto other = leases_.find(id); other != leases_.end()) {
      if (other->second.worker != worker.value)
        other->second.lost = "done by another worker";
      else if (id != r.lease)
        other->second.lost = "done under another lease";
    }
    leave(id, now_ns);
  }
}

void JobTrace::units_freed(const UnitsFreed& freed, TimePoint now) {
  const auto open = leases_.find(freed.lease);
  if (open == leases_.end()) return;
  open->second.lost = to_string(freed.cause);
  for (const UnitKey& unit : freed.units) {
    const auto [first, last] = holders_.equal_range({unit.tile, unit.round});
    const auto it = std::find_if(first, last, [&](const auto& h) { return h.second == freed.lease; });
    if (it == last) continue;
    holders_.erase(it);
    leave(freed.lease, ns(now));
  }
}

// Notes that one of the lease's units is done or was taken back. After the last unit, the lease's span is
// recorded.
void JobTrace::leave(const LeaseId& id, std::int64_t now_ns) {
  const auto open = leases_.find(id);
  if (open == leases_.end() || --open->second.left > 0) return;
  record_lease(id, open->second, now_ns);
  leases_.erase(open);
}

void JobTrace::leases_end(TimePoint now) {
  // A lease that an earlier process granted has `units` 0, since the number of its units is not known. Such a
  // lease ends at the time of its last result; the other leases end now.
  for (const auto& [id, lease] : leases_) record_lease(id, lease, lease.units > 0 ? ns(now) : lease.end_ns);
  leases_.clear();
  holders_.clear();
}

void JobTrace::record_lease(const LeaseId& id, const OpenLease& lease, std::int64_t end_ns) {
  trace::Attributes attributes{{"lightshaft.job", job_},
                               {"lightshaft.lease", id.value},
                               {"lightshaft.worker.id", lease.worker},
                               {"lightshaft.results", lease.results},
                               {"lightshaft.core_seconds", lease.core_seconds}};
  if (!lease.worker_name.empty()) attributes.emplace_back("lightshaft.worker", lease.worker_name);
  if (lease.units > 0) {
    attributes.emplace_back("lightshaft.units", lease.units);
    attributes.emplace_back("lightshaft.samples", lease.samples);
  }
  if (!lease.lost.empty()) attributes.emplace_back("lightshaft.lost", lease.lost);
  tracing_.tracer->record({.context = lease_context(id),
                           .parent = context_.span,
                           .name = "lease",
                           .start_ns = lease.start_ns,
                           .end_ns = std::max(lease.start_ns, end_ns),
                           .attributes = std::move(attributes)});
}

// The job

void JobTrace::end(const StoredJob& job, TimePoint now) {
  if (ended_) return;
  leases_end(now);
  ended_ = true;
  trace::Attributes attributes{{"lightshaft.job", job_},
                               {"lightshaft.state", std::string(to_string(job.state))},
                               {"lightshaft.width", std::int64_t{job.settings.size.width}},
                               {"lightshaft.height", std::int64_t{job.settings.size.height}},
                               {"lightshaft.spp", job.totals.spp_done},
                               {"lightshaft.core_seconds", job.totals.core_seconds}};
  if (job.stopped) attributes.emplace_back("lightshaft.stopped", std::string(to_string(*job.stopped)));
  tracing_.tracer->record({.context = context_,
                           .parent = parent_,
                           .name = "job",
                           .start_ns = start_ns_,
                           .end_ns = ns(now),
                           .attributes = std::move(attributes),
                           .events = std::exchange(events_, {}),
                           .events_left_out = std::exchange(events_left_out_, 0),
                           .failed = job.state == JobState::failed});
}

void JobTrace::begin_again(const StoredJob& job, TimePoint now) {
  if (!ended_) return;
  ended_ = false;
  start_ns_ = std::max(start_ns_, tracing_.tracer->unix_ns(now));
  context_.span = span_of(context_.trace, job, job.totals.ended_unix);
}

}  // namespace ls::coordinator
