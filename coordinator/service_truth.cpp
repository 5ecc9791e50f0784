// Jobs with a reference: every checkpoint's picture is compared with it on a thread of its own, since to see
// a picture takes longer than to add up its error. A job's final image and report wait for its comparisons.
#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "common/base/log.h"
#include "common/image/flip.h"
#include "coordinator/intake.h"
#include "coordinator/service_impl.h"

namespace ls::coordinator {
namespace {
// That wait, each with a picture; then checkpoints go without, but for the last.
constexpr std::size_t kMaxComparisons = 64;
}  // namespace

// Of the checkpoint that has just been taken, or was before a restart without a comparison.
void Service::compare_locked(const EntryPtr& entry, std::span<const RoundIndex> rounds, double spp) {
  if (!entry->truths) return;
  auto tiles = entry->truths->at(rounds);
  entry->truths->checkpoint_taken(rounds);
  if (!tiles || comparisons_.size() >= kMaxComparisons) return;
  comparisons_.push([this, entry, spp, curve = entry->curve, tiles = std::move(*tiles)] {
    compare(entry, curve, spp, tiles, false);
  });
}

// The image as it is handed out, so that the report has all figures of it.
void Service::compare_last_locked(const EntryPtr& entry) {
  if (!entry->truths || entry->points.empty()) return;
  auto tiles = entry->truths->latest();
  if (!tiles) return;
  comparisons_.push([this, entry, curve = entry->curve, spp = entry->points.back().spp,
                     tiles = std::move(*tiles)] { compare(entry, curve, spp, tiles, true); });
}

namespace {

// FLIP takes about a second for each exposure of a frame of HD: at doubling samples, and at the end.
bool wants_flip(const std::vector<ConvergencePoint>& points, double spp) {
  return std::none_of(points.begin(), points.end(), [&](const ConvergencePoint& p) {
    return p.truth && p.truth->flip && p.spp <= spp && spp < 2 * p.spp;
  });
}

}  // namespace

// One reference stays in memory, that of the last comparison: jobs that wait cost nothing.
std::shared_ptr<const Reference> Service::reference_of(const StoredJob& job) {
  const Digest& digest = *job.spec.reference;
  if (reference_ && reference_digest_ == digest && reference_->size == job.settings.size) return reference_;
  auto read = load_reference(job.spec, job.settings.size, *blobs_);
  if (!read) {
    log_error(fmt::format("job={}", job.id.value), read.error().message);
    return nullptr;
  }
  reference_ = std::make_shared<const Reference>(std::move(*read));
  reference_digest_ = digest;
  return reference_;
}

void Service::compare(const EntryPtr& entry, std::uint64_t curve, double spp,
                      const std::vector<TilePicture>& tiles, bool last) {
  std::unique_lock lock(mutex_);
  const auto of_spp = [&](const ConvergencePoint& p) { return p.spp == spp; };
  const auto known = std::find_if(entry->points.begin(), entry->points.end(), of_spp);
  if (entry->removed || entry->curve != curve || known == entry->points.end() ||
      (known->truth && known->truth->flip))
    return;
  const StoredJob job = entry->stored;
  const bool flip = last || wants_flip(entry->points, spp);
  lock.unlock();
  const auto reference = reference_of(job);
  if (!reference) return;
  const FrameSize size = job.settings.size;
  const std::vector<float> image = joined(tiles, size);
  const TrueError error = true_error(*reference, image);
  TrueFigures truth{error.rmse, error.relmse, std::nullopt, error.mse_stderr, error.relmse_stderr};
  const auto noise = reference->error.empty() ? std::nullopt : std::optional(noise_of(*reference));
  if (flip) truth.flip = mean_of(hdr_flip({size, reference->rgb}, {size, image}));
  lock.lock();
  const auto point = std::find_if(entry->points.begin(), entry->points.end(), of_spp);
  if (entry->removed || entry->curve != curve || point == entry->points.end()) return;
  point->truth = truth;
  entry->reference_noise = noise;
  publish_progress_locked(*entry);
  chores_.push([this, id = job.id, spp, truth] {
    if (const auto added = store_->set_truth(id, spp, truth); !added)
      log_error(fmt::format("job={}", id.value), added.error().message);
  });
}

// After the comparisons that were asked for before it, if there are any.
void Service::after_comparisons(const EntryPtr& entry, std::function<void()> chore) {
  if (!entry->truths) return chores_.push(std::move(chore));
  comparisons_.push([this, chore = std::move(chore)] { chores_.push(chore); });
}

}  // namespace ls::coordinator
