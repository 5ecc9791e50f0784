// A clock that advances only when a test advances it. Other threads may read it meanwhile.
#pragma once

#include <atomic>

#include "core/base/clock.h"

namespace ls {

class FakeClock final : public Clock {
 public:
  TimePoint now() const override { return TimePoint(Duration(now_.load())); }
  void advance(Duration d) { now_ += d.count(); }

 private:
  std::atomic<Duration::rep> now_{0};
};

}  // namespace ls
