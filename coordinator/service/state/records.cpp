#include "coordinator/service/state/records.h"

#include <fmt/format.h>

#include "core/base/clock.h"
#include "core/base/failpoint.h"
#include "core/base/log.h"
#include "core/base/safe_text.h"

namespace ls::coordinator {
namespace {
// If more writes than this wait for the disk, log lines are dropped
constexpr std::size_t kMaxLogWrites = 1024;
}  // namespace

bool Records::put(const EntryPtr& entry) {
  if (entry->removed) return true;
  if (together_ && !entry->pin_unsaved) {
    together_->insert(entry);
    return true;
  }
  if (const auto put = store_.put_job(entry->stored); !put) {
    log_error(fmt::format("job={}", entry->stored.id.value), put.error().message);
    not_saved({entry}, put.error());
    return false;
  }
  entry->pin_unsaved = false;
  return true;
}

void Records::put_together(const std::function<void()>& changes) {
  std::set<EntryPtr> changed;
  together_ = &changed;
  changes();
  together_ = nullptr;
  if (const auto put = put_all(changed); !put) {
    log_error("", put.error().message);
    not_saved(std::move(changed), put.error());
  }
}

void Records::retry() {
  std::erase_if(unsaved_, [](const EntryPtr& entry) { return entry->removed; });
  if (unsaved_.empty() || !put_all(unsaved_)) return;
  for (const EntryPtr& entry : unsaved_) entry->pin_unsaved = false;
  unsaved_.clear();
  if (trouble_ == unsaved_because_) trouble_.clear();
}

Result<void> Records::put_all(const std::set<EntryPtr>& entries) const {
  std::vector<StoredJob> records;
  for (const EntryPtr& entry : entries) records.push_back(entry->stored);
  return store_.put_jobs(records);
}

void Records::not_saved(std::set<EntryPtr> entries, const Error& why) {
  unsaved_.merge(entries);
  trouble_ = unsaved_because_ = why.message;
}

Result<void> Records::put_pin(const EntryPtr& entry) {
  if (!entry->pin_unsaved || put(entry)) return {};
  const std::string why = "the job's numeric class cannot be stored: " + trouble_;
  entry->trouble = why + "; then resume the job";
  return fail(Errc::unavailable, why);
}

Result<void> Records::put_quarantined() {
  while (!quarantined_.empty()) {
    if (const auto kept = store_.quarantine(quarantined_.back()); !kept) {
      trouble_ = kept.error().message;
      log_error(fmt::format("worker={}", quarantined_.back().worker.value), kept.error().message);
      return fail(Errc::unavailable, "that a worker is quarantined cannot be stored: " + trouble_);
    }
    quarantined_.pop_back();
  }
  return {};
}

void Records::log(const JobId& id, std::string text) {
  if (!jobs_.find(id)) return;
  if (writes_.size() >= kMaxLogWrites) {  // the disk is slow, or messages arrive too fast
    ++lines_left_out_;
    return;
  }
  if (const auto lost = std::exchange(lines_left_out_, 0))
    text += fmt::format(" (before it {} lines of this and other logs were left out: the disk is slow)", lost);
  // Some texts come from workers: none may look like more than one line
  writes_.push([this, id, line = LogLine{system_unix_seconds(), plain_text(text)}] {
    if (const auto added = store_.add_log(id, line); !added)
      log_warn(fmt::format("job={}", id.value), added.error().message);
  });
}

void Records::add_point(const EntryPtr& entry, const ConvergencePoint& point) {
  entry->points.push_back(point);
  writes_.push([this, id = entry->stored.id, point] {
    const auto added = store_.add_point(id, point);
    note(added);
    if (!added) log_error(fmt::format("job={}", id.value), added.error().message);
    failpoint("checkpoint-stored");
  });
}

void Records::forget_wrong_pixels(JobEntry& entry) {
  entry.stored.denoised_checks.clear();
  forget_curve(entry);
}

void Records::forget_curve(JobEntry& entry) {
  ++entry.curve;
  entry.stored.totals.doubt.clear();
  entry.stored.totals.few_hits.reset();
  if (entry.points.empty()) return;
  entry.points.clear();
  writes_.push([this, id = entry.stored.id] {
    if (const auto removed = store_.remove_points(id); !removed)
      log_error(fmt::format("job={}", id.value), removed.error().message);
  });
}

void Records::set_reference_error(const JobId& id, double spp, const ReferenceError& error) {
  writes_.push([this, id, spp, error] {
    if (const auto added = store_.set_reference_error(id, spp, error); !added)
      log_error(fmt::format("job={}", id.value), added.error().message);
  });
}

}  // namespace ls::coordinator
