// When a job will probably be done. No state, no clock: from what is measured so far.
#pragma once

#include <optional>
#include <span>
#include <utility>

#include "common/image/convergence.h"

namespace ls::coordinator {

struct OutlookFacts {
  double done = 0;          // of the samples asked for, 0 to 1
  double core_seconds = 0;  // spent so far, as the points count them
  double core_left =
      0;  // until the samples end it, or its target, as a steered job foresees it; 0: not known yet
  double core_to_limit = 0;            // until the samples end it, whatever the error; 0: not known yet
  std::optional<double> target, time;  // relMSE; seconds since the first ray
  double elapsed = 0;                  // seconds since the first ray
  double cores = 0;  // of the threads that work on it, or would: CPU seconds in a second of the clock
  double cores_with_more = 0;  // with more workers; not above `cores`: they would not help
  double unit_seconds = 0;     // core seconds of one of the units left, in the mean; 0: not known
  double units_at_once = 0;    // that may be under way, each on one thread; 0: no limit
};

struct Outlook {
  double progress = 0;
  std::optional<double> seconds;                  // from now; nothing: not known yet
  std::optional<std::pair<double, double>> ci95;  // where it is the target that ends the job
  std::optional<double> with_more;                // of `seconds`, where more workers make it less
  std::optional<std::pair<double, double>> with_more_ci95;
};

// Whichever of samples, target and time comes first. The forecast of the target counts from the last point
// (convergence.h); what has been spent since is taken off. Until there is one a steered job's own foresight
// stands in, without an interval. A unit is one thread's, so few units keep few threads busy, and at a
// target's end threads wait for the last ones. Where a forecast's interval reaches beyond the end of the
// samples, it ends there.
Outlook outlook_of(const OutlookFacts& facts, std::span<const ErrorPoint> points);

}  // namespace ls::coordinator
