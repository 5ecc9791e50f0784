// Jobs with a reference image. The picture of every checkpoint is compared with the reference on a separate
// thread, since comparing pictures takes longer than summing errors. A job's final image and report wait for
// its comparisons.
#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "common/base/log.h"
#include "common/image/reference/flip.h"
#include "coordinator/admission/admission.h"
#include "coordinator/service/service_impl.h"

namespace ls::coordinator {
namespace {
// Comparisons that may wait, each of which holds a picture. With more, only the last checkpoint of a job is
// compared
constexpr std::size_t kMaxComparisons = 64;
}  // namespace

// Has a checkpoint compared: the one just taken, or one from before a restart that was not compared then.
void Service::compare_locked(const EntryPtr& entry, std::span<const RoundIndex> rounds, double spp) {
  if (!entry->reference_tiles) return;
  auto tiles = entry->reference_tiles->at(rounds);
  entry->reference_tiles->checkpoint_taken(rounds);
  if (!tiles || comparisons_.size() >= kMaxComparisons) return;
  comparisons_.push([this, entry, spp, curve = entry->curve, tiles = std::move(*tiles)] {
    compare(entry, curve, spp, tiles, false);
  });
}

// Has the final image compared, so that the report is complete.
void Service::compare_last_locked(const EntryPtr& entry) {
  if (!entry->reference_tiles || entry->points.empty()) return;
  auto tiles = entry->reference_tiles->latest();
  if (!tiles) return;
  comparisons_.push([this, entry, curve = entry->curve, spp = entry->points.back().spp,
                     tiles = std::move(*tiles)] { compare(entry, curve, spp, tiles, true); });
}

namespace {

// True if FLIP (the perceived error) should be computed for this checkpoint. It takes about a second per
// exposure of an HD frame, so it is computed only each time the samples have doubled, and at the end.
bool wants_flip(const std::vector<ConvergencePoint>& points, double spp) {
  return std::none_of(points.begin(), points.end(), [&](const ConvergencePoint& p) {
    return p.reference_error && p.reference_error->flip && p.spp <= spp && spp < 2 * p.spp;
  });
}

}  // namespace

// Returns the job's reference. Only that of the last comparison is kept in memory: jobs that wait cost
// nothing.
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
      (known->reference_error && known->reference_error->flip))
    return;
  const StoredJob job = entry->stored;
  const bool flip = last || wants_flip(entry->points, spp);
  lock.unlock();
  const auto reference = reference_of(job);
  if (!reference) return;
  const FrameSize size = job.settings.size;
  const std::vector<float> image = joined(tiles, size);
  const TrueError error = true_error(*reference, image);
  ReferenceError reference_error{error.rmse, error.relmse, std::nullopt, error.mse_stderr,
                                 error.relmse_stderr};
  const auto noise = reference->error.empty() ? std::nullopt : std::optional(noise_of(*reference));
  if (flip) reference_error.flip = mean_of(hdr_flip({size, reference->rgb}, {size, image}));
  lock.lock();
  const auto point = std::find_if(entry->points.begin(), entry->points.end(), of_spp);
  if (entry->removed || entry->curve != curve || point == entry->points.end()) return;
  point->reference_error = reference_error;
  entry->reference_noise = noise;
  publish_progress_locked(*entry);
  background_writes_.push([this, id = job.id, spp, reference_error] {
    if (const auto added = store_->set_reference_error(id, spp, reference_error); !added)
      log_error(fmt::format("job={}", id.value), added.error().message);
  });
}

// Runs `write` on the writer thread. If the job has a reference or is to be denoised, `write` is queued
// behind the job's comparisons that are still to be made, and behind denoising.
void Service::after_comparisons(const EntryPtr& entry, std::function<void()> write) {
  const bool denoise = entry->stored.spec.denoise && on_disk();
  if (!entry->reference_tiles && !denoise) return background_writes_.push(std::move(write));
  if (denoise) comparisons_.push([this, entry, number = entry->finishing] { denoise_final(entry, number); });
  comparisons_.push([this, write = std::move(write)] { background_writes_.push(write); });
}

}  // namespace ls::coordinator
