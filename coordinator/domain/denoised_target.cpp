#include "coordinator/domain/denoised_target.h"

#include <algorithm>

#include "coordinator/domain/limits.h"

namespace ls::coordinator {
namespace {

bool meets(const DenoisedCheck* check, double target) {
  return check != nullptr && check->at_most && *check->at_most <= target;
}

}  // namespace

const DenoisedCheck* DenoisedTarget::find(double spp) const {
  const auto found =
      std::find_if(made_.begin(), made_.end(), [&](const DenoisedCheck& c) { return c.spp == spp; });
  return found == made_.end() ? nullptr : &*found;
}

DenoisedTarget::Answer DenoisedTarget::judge(double spp, double target) {
  if (spp != due_) {
    if (spp < kDenoisedCheckGrowth * due_) return Answer::go_on;
    before_ = due_;
    due_ = spp;
  }
  const DenoisedCheck* now = find(due_);
  if (now == nullptr) return Answer::check;
  return meets(now, target) && meets(find(before_), target) ? Answer::end : Answer::go_on;
}

bool DenoisedTarget::met(double target) const { return meets(find(due_), target); }

void DenoisedTarget::add(const DenoisedCheck& check) {
  if (find(check.spp) == nullptr) made_.push_back(check);
}

double DenoisedTarget::error_left(double target) const {
  const DenoisedCheck* now = find(due_);
  // The job ends after one further check at the earliest, whose level has kDenoisedCheckGrowth times the
  // samples
  const double next = 1 / kDenoisedCheckGrowth;
  return now != nullptr && now->at_most && *now->at_most > 0 ? std::min(next, target / *now->at_most) : next;
}

}  // namespace ls::coordinator
