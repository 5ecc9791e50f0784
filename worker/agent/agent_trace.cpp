// Records trace spans for the units (each one tile and one range of samples) that this worker renders and
// for the scenes that it loads. They are children of the spans of their leases (the lists of units assigned
// to this worker). Used only if the worker has a tracer.
#include <algorithm>
#include <utility>

#include "worker/agent/agent_impl.h"

namespace ls::worker {

void Agent::Impl::record(const char* name, const trace::SpanContext& parent, TimePoint begin, TimePoint end,
                         trace::Attributes attributes, bool failed) const {
  options.tracer->record({.context = {parent.trace, options.tracer->new_span_id(), true},
                          .parent = parent.span,
                          .name = name,
                          .start_ns = options.tracer->unix_ns(begin),
                          .end_ns = options.tracer->unix_ns(std::max(begin, end)),
                          .attributes = std::move(attributes),
                          .failed = failed});
}

// Records the spans of a unit: of rendering it and, unless it failed, of packing its result. Call with the
// mutex held, before the unit leaves the table.
void Agent::Impl::trace_unit(const RenderSlot& slot, const HeldLeases::Held& held,
                             tl::expected<UnitResult, UnitFailure>& outcome) {
  trace::Attributes attributes{{"lightshaft.job", held.key.job.value},
                               {"lightshaft.worker", options.hello.name},
                               {"lightshaft.tile", std::int64_t{held.key.tile}},
                               {"lightshaft.round", std::int64_t{held.key.round}},
                               {"lightshaft.first_sample", static_cast<std::int64_t>(held.unit.samples.s0)},
                               {"lightshaft.last_sample", static_cast<std::int64_t>(held.unit.samples.s1)}};
  if (!outcome) {
    return record("render unit", *held.trace, slot.began, clock.now(), std::move(attributes), true);
  }
  attributes.emplace_back("lightshaft.core_seconds", outcome->cpu_seconds);
  record("render unit", *held.trace, slot.began, slot.last_end, std::move(attributes));
  const TimePoint packed = slot.last_end + from_seconds(outcome->times.transfer);
  record("encode partial", *held.trace, slot.last_end, packed,
         {{"lightshaft.job", held.key.job.value},
          {"lightshaft.bytes", static_cast<std::int64_t>(outcome->exr.size())}});
  outcome->held_unix_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(held.since_unix_ns, 0));
  unsent.insert_or_assign(held.key, Unsent{*held.trace, packed});
}

void Agent::Impl::trace_sent(const UnitKey& unit) {
  Unsent sent;
  {
    const std::lock_guard lock(mutex);
    const auto found = unsent.find(unit);
    if (found == unsent.end()) return;  // the lease is not traced, or the result was sent before
    sent = found->second;
    unsent.erase(found);
  }
  record("send partial", sent.lease, sent.since, clock.now(), {{"lightshaft.job", unit.job.value}});
}

std::optional<trace::SpanContext> Agent::Impl::trace_of(const JobId& job) const {
  if (!options.tracer) return std::nullopt;
  const std::lock_guard lock(mutex);
  const auto first = table.first_waiting(job);
  return first ? first->trace : std::nullopt;
}

Agent::Impl::LoadSpan::LoadSpan(const Impl& a, const JobId& id, TimePoint at)
    : agent(a),
      job(id),
      begin(at),
      parent(a.trace_of(id)),
      own(parent ? trace::SpanContext{parent->trace, a.options.tracer->new_span_id(), true}
                 : trace::SpanContext{}) {}

Agent::Impl::LoadSpan::~LoadSpan() {
  if (!parent) return;
  const trace::Tracer& tracer = *agent.options.tracer;
  agent.options.tracer->record(
      {.context = own,
       .parent = parent->span,
       .name = "load scene",
       .start_ns = tracer.unix_ns(begin),
       .end_ns = tracer.unix_ns(loaded_at ? *loaded_at : agent.clock.now()),
       .attributes = {{"lightshaft.job", job.value}, {"lightshaft.worker", agent.options.hello.name}},
       .failed = !loaded_at});
}

}  // namespace ls::worker
