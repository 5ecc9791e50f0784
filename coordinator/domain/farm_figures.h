// Counters of the farm's work, which /metrics shows; limits on the workers and units of a job or user
// (ShareLimits); and the part of the farm that a job can use (ClassShare).
#pragma once

#include <cstdint>
#include <map>
#include <string_view>
#include <utility>

namespace ls::coordinator {

// Counts of notifications to webhooks since the start: notifications accepted by a receiver, failed attempts,
// and notifications given up. `waiting`: notifications that now wait to be sent.
struct WebhookFigures {
  std::uint64_t delivered = 0, failed_attempts = 0, given_up = 0, waiting = 0;
};

// Why a unit left a worker's lease without a result.
enum class FreedCause {
  worker_lost,
  newer_stream,  // the worker has opened a new connection, which ends the leases of the old one
  deadline_passed,
  returned,  // the worker returned it, since it is draining or could not load the job
  // The lease lasted longer than it should, or the job ended or was paused, and the worker had not begun it
  recalled,
  failed,          // the worker failed to render it
  moved,           // the unit waited behind other units of its worker, and an idle worker gets it
  paused,          // the job was paused
  round_reopened,  // the job was extended, and the round is rendered again with more samples
  worker_quarantined,
  // The tile ended with an earlier round, or the unit's audit was closed: the unit is not rendered again
  not_wanted,
  job_ended  // the job failed or was cancelled, so the unit is not rendered again
};
inline constexpr std::pair<FreedCause, std::string_view> kFreedCauses[] = {
    {FreedCause::worker_lost, "worker lost"},
    {FreedCause::newer_stream, "replaced by a newer stream"},
    {FreedCause::deadline_passed, "deadline passed"},
    {FreedCause::returned, "returned"},
    {FreedCause::recalled, "recalled"},
    {FreedCause::failed, "failed"},
    {FreedCause::moved, "moved to an idle worker"},
    {FreedCause::paused, "job paused"},
    {FreedCause::round_reopened, "round reopened"},
    {FreedCause::worker_quarantined, "worker quarantined"},
    {FreedCause::not_wanted, "not wanted"},
    {FreedCause::job_ended, "job ended"}};

constexpr std::string_view to_string(FreedCause cause) {
  for (const auto& [one, word] : kFreedCauses)
    if (one == cause) return word;
  return "";
}

// Counters of leases, results and additions to the image. All start at 0 when the coordinator starts; members
// whose names end in _now are current values. Terms: docs/reference/glossary.md.
struct FarmFigures {
  // Leases
  std::uint64_t leases_granted = 0, units_leased = 0;
  std::uint64_t leases_now = 0, units_leased_now = 0;
  std::map<FreedCause, std::uint64_t> units_freed;  // units that left a lease without a result
  // Results
  std::uint64_t accepted = 0;
  std::uint64_t equal = 0;      // second results of a unit with the same bits as the first
  std::uint64_t differing = 0;  // second results with other bits: a worker has bad memory or lies
  // Results that were dropped without being used, such as those of a job that has ended or of a quarantined
  // worker
  std::uint64_t unwanted = 0;
  std::uint64_t refused = 0;  // results that failed verification
  // Results that could not be stored: the disk was full or the storage failed otherwise
  std::uint64_t not_stored = 0;
  // Folding
  std::uint64_t folded = 0;     // units whose result was added to the image
  double fold_lag_seconds = 0;  // from a result's arrival to its addition to the image, sum over these units
  std::uint64_t arrived_now = 0;            // results that are being verified and stored
  std::uint64_t arrived_bytes = 0;          // bytes of memory that these results occupy
  std::uint64_t waiting_now = 0;            // accepted results that wait for an earlier round of their tile
  std::uint64_t background_writes_now = 0;  // number of writes that wait for the disk
  // Bytes
  std::uint64_t result_bytes = 0;  // bytes received in results from workers
  std::uint64_t blob_bytes = 0;    // bytes sent to workers in blobs (files of scenes)
};

// Limits on how many workers may hold units, and on how many units may be leased, at the same time; 0: no
// limit. A user's limits hold for all its jobs together.
struct ShareLimits {
  std::uint32_t workers_per_job = 0, units_per_job = 0;
  std::uint32_t workers_per_user = 0, units_per_user = 0;
  bool operator==(const ShareLimits&) const = default;
};

// The part of the farm that can render a job pinned to a numeric class. `workers` and `threads`: those of
// this class; `of_workers` and `of_threads`: those of all classes. Only connected workers that are not
// quarantined count.
struct ClassShare {
  int workers = 0, of_workers = 0;
  int threads = 0, of_threads = 0;
  bool operator==(const ClassShare&) const = default;
};

// Counts of audits since the start of the coordinator. In an audit another worker renders the unit of an
// accepted result again, and the two results are compared.
struct AuditFigures {
  std::uint64_t asked = 0;  // number of audits that began
  std::uint64_t equal = 0;  // audits whose second result had the same bits
  // Units whose second result had other bits: a third worker had to decide, or the job failed
  std::uint64_t differ = 0;
  std::uint64_t dropped = 0;  // audits given up: no other worker could render the unit, or the job ended
  // Results chosen for an audit that did not begin: no other worker that computes the same bits (of the same
  // numeric class) was connected
  std::uint64_t missed = 0;
  std::uint64_t workers_quarantined = 0, tiles_discarded = 0;
};

}  // namespace ls::coordinator
