#include "coordinator/service/reference_comparer.h"

#include <fmt/format.h>

#include <algorithm>

#include "coordinator/admission/admission.h"
#include "coordinator/service/core.h"
#include "core/base/log.h"
#include "core/image/reference/flip.h"

namespace ls::coordinator {
namespace {
// At most this many comparisons of checkpoints wait, since each holds a picture in memory. While so many
// wait, new checkpoints are not compared. The final image is always compared.
constexpr std::size_t kMaxComparisons = 64;

// True if FLIP (the perceived error) should be computed for this checkpoint. FLIP compares the images at
// several exposures and takes about a second for each (at HD size), so it is computed only each time the
// samples have doubled, and at the end.
bool wants_flip(const std::vector<ConvergencePoint>& points, double spp) {
  return std::none_of(points.begin(), points.end(), [&](const ConvergencePoint& p) {
    return p.reference_error && p.reference_error->flip && p.spp <= spp && spp < 2 * p.spp;
  });
}

}  // namespace

void ReferenceComparer::loop(const std::stop_token& token) {
  while (!token.stop_requested())
    for (auto& task : tasks_.pop(1, token)) task();
}

void ReferenceComparer::compare(Core&, const EntryPtr& entry, std::span<const RoundIndex> rounds,
                                double spp) {
  if (!entry->reference_tiles) return;
  auto tiles = entry->reference_tiles->at(rounds);
  entry->reference_tiles->checkpoint_taken(rounds);
  if (!tiles || tasks_.size() >= kMaxComparisons) return;
  tasks_.push([this, entry, spp, curve = entry->curve, tiles = std::move(*tiles)] {
    compare_tiles(entry, curve, spp, tiles, false);
  });
}

void ReferenceComparer::compare_last(Core&, const EntryPtr& entry) {
  if (!entry->reference_tiles || entry->points.empty()) return;
  auto tiles = entry->reference_tiles->latest();
  if (!tiles) return;
  tasks_.push([this, entry, curve = entry->curve, spp = entry->points.back().spp, tiles = std::move(*tiles)] {
    compare_tiles(entry, curve, spp, tiles, true);
  });
}

// Returns the job's reference image; null if it cannot be read. Only the reference image that was used last
// is kept in memory. A comparison that waits in the queue holds no reference image; it is read when the
// comparison begins.
std::shared_ptr<const Reference> ReferenceComparer::reference_of(const StoredJob& job) {
  const Digest& digest = *job.spec.reference;
  if (reference_ && reference_digest_ == digest && reference_->size == job.settings.size) return reference_;
  auto read = load_reference(job.spec, job.settings.size, blobs_);
  if (!read) {
    log_error(fmt::format("job={}", job.id.value), read.error().message);
    return nullptr;
  }
  reference_ = std::make_shared<const Reference>(std::move(*read));
  reference_digest_ = digest;
  return reference_;
}

void ReferenceComparer::compare_tiles(const EntryPtr& entry, std::uint64_t curve, double spp,
                                      const std::vector<TilePicture>& tiles, bool last) {
  auto core = core_.lock();
  const auto of_spp = [&](const ConvergencePoint& p) { return p.spp == spp; };
  const auto known = std::find_if(entry->points.begin(), entry->points.end(), of_spp);
  if (entry->removed || entry->curve != curve || known == entry->points.end() ||
      (known->reference_error && known->reference_error->flip))
    return;
  const StoredJob job = entry->stored;
  const bool flip = last || wants_flip(entry->points, spp);
  core.unlock();
  const auto reference = reference_of(job);
  if (!reference) return;
  const FrameSize size = job.settings.size;
  const std::vector<float> image = joined(tiles, size);
  const TrueError error = true_error(*reference, image);
  ReferenceError reference_error{error.rmse, error.relmse, std::nullopt, error.mse_stderr,
                                 error.relmse_stderr};
  const auto noise = reference->error.empty() ? std::nullopt : std::optional(noise_of(*reference));
  if (flip) reference_error.flip = mean_of(hdr_flip({size, reference->rgb}, {size, image}));
  core.lock();
  const auto point = std::find_if(entry->points.begin(), entry->points.end(), of_spp);
  if (entry->removed || entry->curve != curve || point == entry->points.end()) return;
  point->reference_error = reference_error;
  entry->reference_noise = noise;
  core->publisher.progress(*entry);
  core->records.set_reference_error(job.id, spp, reference_error);
}

}  // namespace ls::coordinator
