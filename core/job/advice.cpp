#include "core/job/advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/image/frame/rounds.h"
#include "core/job/limits.h"

namespace ls {
namespace {

// The number of samples that halves the RMSE, if it falls as that of independent samples
std::uint64_t next_spp(double done) {
  const double next = std::clamp(4 * std::ceil(done), 64.0, static_cast<double>(kMaxSpp));
  return even_spp(static_cast<std::uint64_t>(next));
}

}  // namespace

std::string advice_on(const ConvergenceStatus& status, const Advised& job) {
  if (status.trusted) return "";
  if (status.kind == ConvergenceStatus::Kind::bias_floor)
    return "image and reference disagree, and more samples will not help: check that the reference shows "
           "this "
           "scene with this camera and these settings";
  const std::string what = !job.lit ? "no light found yet: check that a light reaches what the camera sees"
                           : job.relmse > 0 ? "still noisy: a few bright pixels carry the error"
                                            : "too few samples so far to tell the error";
  if (job.goes_on) return what + "; more samples are on their way";
  const std::uint64_t next = next_spp(job.spp_done);
  if (!job.can_extend || static_cast<double>(next) <= job.spp_done) return what;
  return fmt::format("{}; render on: lightshaft extend {} --spp {}", what, job.job, next);
}

}  // namespace ls
