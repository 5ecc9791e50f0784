// Converts the structs of util/protocol/messages.h to protobuf messages.
#include <algorithm>
#include <utility>

#include "core/base/overloaded.h"
#include "proto/convert.h"

namespace ls::wire {
namespace {

// Returns the number of bytes of the UTF-8 character that begins at `i` (RFC 3629: shortest forms, no
// surrogates, up to U+10FFFF); 0 if the bytes from `i` on are no such character.
std::size_t character_length(const std::string& text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U; };
  const unsigned first = byte(i);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xC2 && first < 0xE0   ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  for (std::size_t k = 1; k < length; ++k)
    if ((byte(i + k) & 0xC0) != 0x80) return 0;
  const unsigned second = byte(i + 1);
  const bool wrong = (first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
                     (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F);
  return wrong ? 0 : length;
}

}  // namespace

std::string sendable(const std::string& text, std::size_t limit) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = character_length(text, i);
    if (out.size() + std::max<std::size_t>(length, 1) > limit) break;
    if (length == 0) {
      out += '?';
      ++i;
    } else {
      out.append(text, i, length);
      i += length;
    }
  }
  return out;
}

namespace {

void put(const UnitKey& key, pb::UnitKey* out) {
  out->set_job(key.job.value);
  out->set_tile(key.tile);
  out->set_round(key.round);
}

void put(const Error& error, pb::Problem* out) {
  out->set_code(std::string(to_string(error.code)));
  out->set_message(sendable(error.message, limits::kTextBytes));
}

void put(const JobBrief& brief, pb::JobBrief* out) {
  out->set_job(brief.job.value);
  out->set_scene(digest_bytes(brief.scene));
  out->set_settings(canonical_json(brief.settings));
  out->set_needs(brief.needs);
  for (const BlobRef& asset : brief.assets) {
    pb::Blob* blob = out->add_assets();
    blob->set_digest(digest_bytes(asset.digest));
    blob->set_bytes(asset.bytes);
    blob->set_name(sendable(asset.name, limits::kNameBytes));
  }
}

void put(const WorkerHello& hello, pb::FromWorker& out) {
  pb::Hello* h = out.mutable_hello();
  h->set_protocol(hello.protocol);
  h->set_name(sendable(hello.name, limits::kNameBytes));
  h->set_build(sendable(hello.build, limits::kNameBytes));
  h->set_numeric_class(digest_bytes(hello.numeric_class));
  h->set_threads(hello.threads);
  h->set_memory_bytes(hello.memory_bytes);
  for (const std::string& tag : hello.tags) h->add_tags(sendable(tag, limits::kNameBytes));
  for (const Digest& blob : hello.blobs_held) h->add_blobs_held(digest_bytes(blob));
  h->set_join_token(hello.join_token);
  h->set_previous_id(hello.previous_id.value);
  h->set_fake(hello.fake);
  h->set_platform(sendable(hello.platform, limits::kNameBytes));
  if (hello.secret) h->set_secret(*hello.secret);
  h->set_brief_bytes(hello.brief_bytes);
  h->set_restarts(hello.restarts);
}

void put(const WorkerProgress& progress, pb::FromWorker& out) {
  pb::Progress* p = out.mutable_progress();
  for (const WorkerProgress::Entry& entry : progress.leases) {
    pb::Progress::Entry* e = p->add_leases();
    e->set_lease(entry.lease.value);
    e->set_units_done(entry.units_done);
  }
  p->set_activity(sendable(progress.activity, limits::kNameBytes));
  p->set_cpu_seconds_total(progress.cpu_seconds_total);
  p->set_rss_bytes(progress.rss_bytes);
  p->set_load_seconds(progress.load_seconds);
}

void put(const UnitResult& result, pb::FromWorker& out) {
  pb::UnitResult* r = out.mutable_result();
  put(result.unit, r->mutable_unit());
  r->set_lease(result.lease.value);
  r->set_exr(result.exr.data(), result.exr.size());
  r->set_digest(digest_bytes(result.digest));
  r->set_cpu_seconds(result.cpu_seconds);
  r->set_nonfinite(result.health.nonfinite);
  r->set_negative(result.health.negative);
  r->set_majorant_violations(result.health.majorant_violations);
  if (!result.health.clean()) r->set_health(canonical_json(result.health));
  r->set_techniques(result.techniques.bits());
  r->set_held_unix_ns(result.held_unix_ns);
  if (result.times == UnitTimes{}) return;
  pb::UnitTimes* times = r->mutable_times();
  times->set_load(result.times.load);
  times->set_build(result.times.build);
  times->set_transfer(result.times.transfer);
  times->set_idle(result.times.idle);
  times->set_wait(result.times.wait);
}

void put(const UnitFailure& failure, pb::FromWorker& out) {
  pb::UnitFailure* f = out.mutable_failure();
  put(failure.unit, f->mutable_unit());
  f->set_lease(failure.lease.value);
  f->set_scene_at_fault(failure.scene_at_fault);
  f->set_reason(sendable(failure.reason, limits::kTextBytes));
  if (failure.signal) f->set_signal(*failure.signal);
  if (failure.pixel) {
    f->set_pixel_x(failure.pixel->first);
    f->set_pixel_y(failure.pixel->second);
  }
  if (failure.sample) f->set_sample(*failure.sample);
}

void put(const LeaseReturned& returned, pb::FromWorker& out) {
  out.mutable_returned()->set_lease(returned.lease.value);
  for (const UnitKey& key : returned.unrendered) put(key, out.mutable_returned()->add_units());
  out.mutable_returned()->set_reason(sendable(returned.reason, limits::kReasonBytes));
  out.mutable_returned()->set_unknown_job(returned.unknown_job);
}

void put(const WorkerDraining& d, pb::FromWorker& out) {
  pb::Draining* draining = out.mutable_draining();
  draining->set_withdrawn(d.withdrawn);
  draining->set_restarts(d.restarts);
  draining->set_refused(sendable(d.refused, limits::kReasonBytes));
}
void put(const Welcome& welcome, pb::ToWorker& out) {
  out.mutable_welcome()->set_worker(welcome.worker.value);
  out.mutable_welcome()->set_epoch(welcome.epoch);
  out.mutable_welcome()->set_secret(welcome.secret);
}

void put(const Refused& refused, pb::ToWorker& out) {
  put(refused.error, out.mutable_refused()->mutable_problem());
  out.mutable_refused()->set_retry(refused.retry);
}

void put(const AssignLease& assign, pb::ToWorker& out) {
  pb::AssignLease* a = out.mutable_assign();
  a->set_lease(assign.lease.id.value);
  a->set_job(assign.lease.job.value);
  for (const LeaseUnit& unit : assign.lease.units) {
    pb::LeaseUnit* u = a->add_units();
    u->set_tile(unit.tile);
    u->set_round(unit.round);
    u->mutable_rect()->set_x0(unit.rect.x0);
    u->mutable_rect()->set_y0(unit.rect.y0);
    u->mutable_rect()->set_x1(unit.rect.x1);
    u->mutable_rect()->set_y1(unit.rect.y1);
    u->set_s0(unit.samples.s0);
    u->set_s1(unit.samples.s1);
  }
  if (assign.brief) put(*assign.brief, a->mutable_brief());
  if (assign.trace) a->set_traceparent(to_traceparent(*assign.trace));
}

void put(const ResultAck& ack, pb::ToWorker& out) {
  put(ack.unit, out.mutable_ack()->mutable_unit());
  if (ack.refused) put(*ack.refused, out.mutable_ack()->mutable_refused());
}

void put(const CancelJob& cancel, pb::ToWorker& out) { out.mutable_cancel_job()->set_job(cancel.job.value); }
void put(const CancelLease& cancel, pb::ToWorker& out) {
  out.mutable_cancel_lease()->set_lease(cancel.lease.value);
}

void put(const RecallLease& recall, pb::ToWorker& out) {
  out.mutable_recall_lease()->set_lease(recall.lease.value);
}

void put(const DrainNow& d, pb::ToWorker& out) {
  out.mutable_drain()->set_withdrawn(d.withdrawn);
  out.mutable_drain()->set_restart(d.restart);
}

}  // namespace

pb::FromWorker to_wire(const FromWorker& message) {
  pb::FromWorker out;
  std::visit([&out](const auto& m) { put(m, out); }, message);
  return out;
}

pb::ToWorker to_wire(const ToWorker& message) {
  pb::ToWorker out;
  std::visit([&out](const auto& m) { put(m, out); }, message);
  return out;
}

std::string digest_bytes(const Digest& digest) {
  return {reinterpret_cast<const char*>(digest.bytes.data()), digest.bytes.size()};
}

}  // namespace ls::wire
