// Adaptive sampling (AdaptiveStop) decides when the tiles of a job with a target error stop getting samples.
// It reads only the tiles' own error estimates. A round is a fixed range of sample indices
// (core/image/frame/rounds.h); folding adds the pixel sums of a tile's round to the image. Tiles stop in
// groups (stop_groups()).
//
// The image's relMSE is the mean over its pixels. Take a group of p pixels whose relative variance per
// sample, averaged over pixels and channels, is a. After n samples per pixel it adds p a / n to the sum over
// the image's pixels, and it has cost p n samples. For a given total cost the sum is least if one more sample
// lowers it equally in every group: where a / n^2 is equal, so n is proportional to sqrt(a). (Equal errors in
// all groups, with n proportional to a, would cost as much as uniform sampling.) In rounds: let n_k be the
// samples per pixel up to the end of round k. Group g continues after round k as long as its gain
// a / (n_k n_(k+1)), the error that the next round removes per sample, exceeds a level common to all groups
// (marginal allocation, Fox 1966).
//
// The right level for a target is not known in advance, and must not depend on which results arrive first. So
// the level falls step by step on a fixed grid, 2^(-j/4). At each level every group stops independently; when
// all groups have stopped, the error of the image is predicted: either it meets the target, or the level
// falls. After which round each group stops at a level depends on the groups' errors alone, and the sequence
// of levels does not even depend on the target: a smaller target continues where a larger one ended, so an
// extended job has the same bits as one that had the smaller target from the start.
//
// The decision to stop after round k does not use the error after round k: a group's own last error would
// bias the decision towards stopping. Instead the error after round k is predicted from the rounds before k,
// with a variance that falls as 1/n. (Samplers that converge faster make the image better than requested.)
// The image's error is predicted in the same way. If this prediction meets the target, the error that was
// estimated after the last rounds must meet it, too; otherwise the level falls. No tile stops before
// kMinSppBeforeStop samples per pixel. The cost per sample is taken to be equal everywhere: measured times
// would make pixels depend on the machine. An unknown error (NaN) stops nothing.
//
// Both this rule and the error estimates that it reads use only +, -, *, / and square roots, which give the
// same bits on every machine: another coordinator that takes over the job makes the same decisions.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "coordinator/domain/job_state.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"

namespace ls::coordinator {

// Returns the groups of tiles that stop getting samples together. The tiles of a group are ascending, and the
// groups are in the order of their first tiles. Every tile is in exactly one group. A decision to stop that
// rests on few pixels biases the image, so at least kMinStopPixels pixels decide together: small tiles form
// blocks, and the tiles that remain at the right and bottom edges join the neighbouring block. An image with
// fewer pixels than that forms a single group. The groups depend on nothing but the tiling.
std::vector<std::vector<TileIndex>> stop_groups(const TileGrid& grid);

// Returns the next level (threshold for stopping) below `gain`: the largest number of the grid {2^(-j/4)}, j
// any integer, that is less than `gain`. Returns 0 for 0.
double level_below(double gain);

class AdaptiveStop {
 public:
  // `spp` is the sample limit: no tile gets more samples per pixel.
  AdaptiveStop(const TileGrid& grid, std::uint64_t spp);

  // Adds the error of the tile after rounds 0..round, which are in the image now. `rel_error_sum` is the sum
  // of the relative squared error over the tile's pixels and channels (TileError::relative.squares). The
  // rounds of one tile must come in order; tiles may come in any order.
  void folded(TileIndex tile, RoundIndex round, double rel_error_sum);

  // Returns the last of the tile's rounds that are certain to be needed: all rounds up to this one may be
  // added to the image. If the image meets the target at the current level, this is the tile's last round.
  RoundIndex wanted(TileIndex tile) const { return groups_[group_of_[tile]].stop; }

  // Returns the tiles that stop together with this tile, including the tile itself.
  std::span<const TileIndex> neighbours(TileIndex tile) const { return groups_[group_of_[tile]].tiles; }

  // True if all groups of tiles have stopped at the current level.
  bool settled() const { return settled_ == groups_.size(); }
  // Decides whether the image's relMSE at the current level is at most `target`. `unknown`: not all groups of
  // tiles have stopped, or the error of some group's last round is not known yet.
  enum class Verdict { unknown, no, yes };
  Verdict judge(double target) const;
  // Returns the relMSE of the image at the current level. It is predicted for the end of each tile's last
  // round, from the errors after the rounds before. Requires settled().
  double predicted() const;
  // True if every group of tiles has reached the sample limit, so that no group can continue.
  bool exhausted() const;
  // Goes to the next lower level (threshold for stopping), at which some groups of tiles may continue.
  // Requires settled() and not exhausted(). If no group has a known and positive gain (the error that one
  // more round removes per sample), all groups continue to the sample limit.
  void lower();
  double level() const { return level_; }

  // Returns for each tile how many rounds it has if the image ends at this level. Requires settled().
  std::vector<RoundIndex> ends() const;
  double mean_spp() const;  // samples per pixel if the image ends at this level, mean over all pixels

  // True if at least one group of tiles has reached the sample limit.
  bool bound() const;
  // Raises the sample limit to `spp` samples per pixel. Requires !bound(): a group of tiles that reached the
  // old limit might have continued under a higher one.
  void extend(std::uint64_t spp);

  // Speculation: the functions below predict which rounds will probably be needed, so that workers can render
  // these early. They affect no pixel.
  //
  // foresee() predicts the level (threshold for stopping) at which the image will meet `target`, and with it
  // how many rounds each tile gets. It does nothing until every group of tiles has kFirstForecast rounds.
  void foresee(double target);
  // Returns how many rounds of the tile will probably be needed, not fewer than are certain to be needed.
  RoundIndex predicted_last(TileIndex tile) const;
  // Returns the variance per sample of the tile's group, estimated from its last known round; NaN if unknown.
  // The queue of units (unit_queue.h) uses it to order speculative rounds.
  double variance(TileIndex tile) const;
  // Returns how many pixel samples are still missing up to the predicted ends of all groups; nullopt if
  // foresee() has not predicted them yet.
  std::optional<double> samples_left() const;
  double samples_to_limit() const;  // how many pixel samples are missing up to the sample limit
  // Number of rounds added so far, summed over all groups of tiles. A round of a group counts when all its
  // tiles have it
  std::uint64_t rounds_seen() const { return rounds_seen_; }
  std::size_t groups() const { return groups_.size(); }

 private:
  struct Group {
    std::vector<TileIndex> tiles;
    double pixels = 0;
    std::vector<double> sums;  // sums[k]: error sum of the group's tiles after round k, added in tile order
    RoundIndex stop = 0;       // the earliest round that may be the group's last
    RoundIndex predicted_last = 0;  // the round that will probably be the group's last
    bool settled = false;           // true if `stop` is the group's last round at this level
  };
  // Variance per sample, estimated from the group's error after rounds 0..round
  double variance(const Group& g, RoundIndex round) const;
  // Pixel samples that the group still needs up to the end of round `last`
  double samples_missing(const Group& g, RoundIndex last) const;
  double gain(const Group& g) const;  // the error that the round after `stop` removes per sample
  // relMSE of the image, from the error of each group after its round `stop`. Requires that all these are
  // known
  double measured() const;
  // True if the group's error after its round `stop` is known
  static bool whole(const Group& g) { return g.sums.size() > g.stop; }
  void advance(Group& g);

  TileGrid grid_;
  std::uint64_t spp_;
  RoundIndex last_;  // the last round within the sample limit
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_of_;
  // waiting_[tile]: error sums of the tile after rounds that some other tile of its group has not reached yet
  std::vector<std::vector<double>> waiting_;
  std::size_t settled_ = 0;
  double level_ = std::numeric_limits<double>::infinity();
  std::uint64_t rounds_seen_ = 0;
  bool speculative_ = false;
};

// Decides when a job ends if its target error applies to its denoised layers
// (util/denoise/denoised_image.h). The stop rule (AdaptiveStop) still decides which tiles get samples,
// from the errors of the image itself: its levels do not depend on the denoiser. This class only decides at
// which level the job ends.
//
// The denoised error is checked at some levels: at the first one, and then whenever the samples have grown by
// kDenoisedCheckGrowth. Which levels these are depends neither on the target nor on earlier checks, so a job
// that gets a smaller target later continues as if it had that target from the start.
//
// The job ends when at two successive checks the upper end of the error's 95 % interval is at most the
// target. One check is not enough, since its estimate may be low by chance; the second one includes further
// samples. A check without an interval meets no target. A job whose image has no noise ends at the first
// check that meets the target: more samples would not change its pixels.
//
// A denoiser may give different results on different machines. So each check is made once, by the
// coordinator, and stored with the job: after a restart, or at another coordinator, the stored values decide.
class DenoisedTarget {
 public:
  // `made` are the checks that are stored with the job.
  explicit DenoisedTarget(std::vector<DenoisedCheck> made = {}) : made_(std::move(made)) {}

  // Decides whether the job ends at the level with `spp` samples per pixel. Calls must come in the order of
  // levels; a call for the latest level may be repeated, with another target. `check`: the caller must first
  // compute the error of the denoised layers at this level, add() it, and call again.
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
  // Samples per pixel of the latest level that needs a check, and of the one before it; 0: none
  double due_ = 0, before_ = 0;
};

}  // namespace ls::coordinator
