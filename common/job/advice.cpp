#include "common/job/advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/image/frame/rounds.h"
#include "common/job/limits.h"

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
  const bool dark = !(job.relmse > 0);
  const std::string what = dark ? "no light found yet: check that a light reaches what the camera sees"
                                : "still noisy: a few bright pixels carry the error";
  if (job.goes_on) return what + "; more samples are on their way";
  if (!job.can_extend) return what;
  return fmt::format("{}; render on: lightshaft extend {} --spp {}", what, job.job, next_spp(job.spp_done));
}

}  // namespace ls
