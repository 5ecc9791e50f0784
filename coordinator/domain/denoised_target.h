// Decides when a job ends if its target error applies to its denoised layers
// (common/denoise/denoised_image.h). The stop rule (adaptive_stop.h) still decides which tiles get samples,
// from the errors of the image itself: its levels do not depend on the denoiser. This class only decides at
// which level the job ends.
//
// The denoised error is checked at some levels: at the first one, and then whenever the samples have grown by
// kDenoisedCheckGrowth. Which levels these are depends neither on the target nor on earlier checks, so a job
// that gets a smaller target later continues as if it had that target from the start.
//
// The job ends when at two successive checks the upper end of the error's 95 % interval is at most the
// target. One check is not enough, since its estimate may be low by chance; the second one includes further
// samples. A check without an interval meets no target. An image without noise ends at the first check that
// meets the target: more samples do not change its pixels.
//
// A denoiser may give different results on different machines. So each check is made once, by the
// coordinator, and stored with the job: after a restart, or at another coordinator, the stored values decide.
#pragma once

#include <optional>
#include <vector>

namespace ls::coordinator {

// The error of the denoised layers at one level of the stop rule (adaptive_stop.h).
struct DenoisedCheck {
  double spp = 0;     // samples per pixel at this level, mean over all pixels; identifies the level
  double relmse = 0;  // estimated; noise can bring it below 0
  // The largest relMSE that the 95 % interval allows; nullopt: the interval is not known
  std::optional<double> at_most;
  bool operator==(const DenoisedCheck&) const = default;
};

class DenoisedTarget {
 public:
  // `made` are the checks that are stored with the job.
  explicit DenoisedTarget(std::vector<DenoisedCheck> made = {}) : made_(std::move(made)) {}

  // Decides whether the job ends at the level with `spp` samples per pixel. Calls must come in the order of
  // levels; a call for the latest level may be repeated, with another target. `check`: the error of the
  // denoised layers at this level must be checked first.
  enum class Answer { go_on, check, end };
  Answer judge(double spp, double target);
  void add(const DenoisedCheck& check);
  // True if the latest level at which judge() requires a check was checked and meets the target.
  bool met(double target) const;
  // True if the level with `spp` samples per pixel is the latest one at which judge() requires a check.
  bool due(double spp) const { return spp == due_; }

  // Predicts the error of the image itself at the job's end, divided by its present error. Affects no pixel.
  double error_left(double target) const;

 private:
  const DenoisedCheck* find(double spp) const;

  std::vector<DenoisedCheck> made_;
  double due_ = 0, before_ = 0;  // samples of the last level that is checked, and of the one before; 0: none
};

}  // namespace ls::coordinator
