#include "util/trace/span_queue.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace ls::trace {

void SpanQueue::add(Span span, TimePoint now) {
  if (waiting_.size() >= kMaxWaiting) {
    ++figures_.left_out;
    return;
  }
  if (waiting_.empty()) first_at_ = now;
  waiting_.push_back(std::move(span));
}

const std::vector<Span>& SpanQueue::due(TimePoint now) {
  static const std::vector<Span> kNone;
  const auto at = next_due();
  if (!at || now < *at) return kNone;
  if (batch_.empty()) {
    const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(std::min(waiting_.size(), kMaxBatch));
    batch_.assign(std::make_move_iterator(waiting_.begin()), std::make_move_iterator(end));
    waiting_.erase(waiting_.begin(), end);
    first_at_ = now;
    attempts_ = 0;
  }
  return batch_;
}

std::optional<TimePoint> SpanQueue::next_due() const {
  if (batch_.empty() && waiting_.empty()) return std::nullopt;
  if (hurried_) return TimePoint{};
  const bool full = !batch_.empty() || waiting_.size() >= kMaxBatch;
  return full ? not_before_ : std::max(not_before_, first_at_ + from_seconds(kCollectSeconds));
}

void SpanQueue::taken(std::uint64_t rejected) {
  const std::uint64_t lost = std::min<std::uint64_t>(rejected, batch_.size());
  figures_.refused += lost;
  figures_.sent += batch_.size() - lost;
  batch_.clear();
  failures_ = 0;
  in_trouble_ = false;
  not_before_ = {};
}

void SpanQueue::failed(TimePoint now) {
  in_trouble_ = true;
  ++failures_;
  if (++attempts_ >= kMaxSendings) {
    figures_.refused += batch_.size();
    batch_.clear();
  }
  const int doublings = std::min(failures_, kMaxSendings) - 1;
  not_before_ = now + from_seconds(kFirstPauseSeconds * std::exp2(doublings));
}

void SpanQueue::refused() {
  figures_.refused += batch_.size();
  batch_.clear();
  failures_ = 0;
  in_trouble_ = true;
}

}  // namespace ls::trace
