#include "coordinator/webhooks/line.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ls::coordinator::webhooks {

double retry_seconds(int attempts) {
  return std::min(kFirstRetrySeconds * std::exp2(std::clamp(attempts - 1, 0, 30)), kMaxRetrySeconds);
}

std::optional<Delivery> Line::add(Delivery delivery) {
  std::optional<Delivery> given_up;
  if (waiting_.size() >= kMaxWaiting) given_up = pop();
  waiting_.push_back(std::move(delivery));
  return given_up;
}

const Delivery* Line::due(TimePoint now) const {
  return waiting_.empty() || now < not_before_ ? nullptr : &waiting_.front();
}

std::optional<TimePoint> Line::next_due() const {
  return waiting_.empty() ? std::nullopt : std::optional(not_before_);
}

std::optional<Delivery> Line::taken() {
  if (waiting_.empty()) return std::nullopt;
  return pop();
}

std::optional<Delivery> Line::failed(TimePoint now) {
  if (waiting_.empty()) return std::nullopt;
  if (++attempts_ >= kMaxAttempts) return pop();
  not_before_ = now + from_seconds(retry_seconds(attempts_));
  return std::nullopt;
}

Delivery Line::pop() {
  Delivery first = std::move(waiting_.front());
  waiting_.pop_front();
  attempts_ = 0;
  not_before_ = TimePoint{};
  return first;
}

}  // namespace ls::coordinator::webhooks
