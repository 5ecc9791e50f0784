// The clock of a job. It starts with the job's first ray and stands still while the job is paused or done.
#pragma once

#include <algorithm>
#include <optional>

#include "core/base/clock.h"

namespace ls::coordinator {

class JobClock {
 public:
  bool started() const { return zero_.has_value(); }
  // The time at which a clock that always ran, and shows the same now, would have shown 0; nullopt: the clock
  // has not started.
  std::optional<TimePoint> zero(TimePoint now) const {
    return zero_ ? std::optional(*zero_ + stood(now)) : std::nullopt;
  }
  // Seconds that the clock shows; 0: it has not started.
  double shows(TimePoint now) const {
    return zero_ ? std::max(0.0, seconds(still_since_.value_or(now) - *zero_)) : 0;
  }
  void start(TimePoint zero) { zero_ = zero; }  // the clock showed 0 at this time
  void stand_still(TimePoint now) {
    if (!still_since_) still_since_ = now;
  }
  void go_on(TimePoint now) {
    if (zero_) *zero_ += stood(now);
    still_since_.reset();
  }
  void reset() { zero_.reset(); }  // the clock has not started; if it stood still, it still does

 private:
  Duration stood(TimePoint now) const {
    return still_since_ ? now - std::max(*still_since_, *zero_) : Duration{};
  }
  std::optional<TimePoint> zero_;
  std::optional<TimePoint> still_since_;
};

}  // namespace ls::coordinator
