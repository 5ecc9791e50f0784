// When the tiles of a job with a target error stop: adaptive sampling, as a function of the tiles' own
// errors.
//
// The image's relMSE is the mean over its pixels. A group of p pixels whose variance per sample is a (mean
// over pixels and channels, relative) adds p a / n to it after n samples and costs p n. The sum is least for
// its cost where one more sample lowers it equally everywhere, so where a / n^2 is equal: n ~ sqrt(a). (Equal
// errors everywhere, n ~ a, would cost as much as uniform sampling.) In rounds: group g goes on after round k
// as long as its gain a / (n_k n_k+1), what the next round takes off per sample, exceeds a level common to
// all (marginal allocation, Fox 1966).
//
// The right level for a target is not known in advance, and must not depend on who rendered what first. So
// levels fall step by step on a fixed grid, 2^(-j/4). At each level every group comes to a stop by itself;
// when all have, the error of the image is predicted, and either it is down to the target or the level falls.
// Each state depends on the groups' errors alone, and the sequence of states not even on the target: a
// smaller target goes on where a larger one ended, so that an extended job has the bits of one that had the
// smaller target from the first.
//
// The decision to stop after round k uses the errors after the rounds before k and predicts that at k (the
// variance falls as 1/n; samplers that do better make the image better than asked): a group's own last round
// would bias it low. So does the judgement of the image; only when it says that the target is met are the
// last rounds asked, too, and may make the image go on. Nothing stops before kMinSppBeforeStop. Cost per
// sample counts as equal everywhere: measured times would make pixels depend on the machine. An error that is
// not known (NaN) stops nothing.
//
// All of it, and the error estimates that it is fed, is made of +, -, *, / and square roots, which are the
// same bits on every machine: another coordinator that takes the job over decides alike.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "common/image/frame.h"
#include "common/image/rounds.h"

namespace ls::coordinator {

// The largest number of the grid {2^(-j/4)} below `gain`, and never above it; 0 for 0.
double level_below(double gain);

class AdaptiveStop {
 public:
  // `spp`: the most samples that any tile gets.
  AdaptiveStop(const TileGrid& grid, std::uint64_t spp);

  // A tile's sum over pixels and channels of the relative squared error with rounds 0..round
  // (TileError::relative.squares). Rounds of a tile in order; tiles in any.
  void folded(TileIndex tile, RoundIndex round, double rel_error_sum);

  // The last round of the tile that is wanted whatever comes: it may be folded. At a decision the tile's
  // last.
  RoundIndex wanted(TileIndex tile) const { return groups_[group_of_[tile]].stop; }

  // The tiles that stop with this one, itself among them.
  std::span<const TileIndex> neighbours(TileIndex tile) const { return groups_[group_of_[tile]].tiles; }

  // All groups have come to a stop at this level.
  bool settled() const { return settled_ == groups_.size(); }
  // Whether the image is good enough at this level.
  enum class Verdict { unknown, no, yes };
  Verdict judge(double target) const;
  // relMSE of the image at this level, predicted from the rounds before the last of each tile; only when
  // settled.
  double predicted() const;
  // Every group has all the samples there are: nothing can go on.
  bool exhausted() const;
  // Goes to the next level; only when settled and not exhausted. Where nothing is known to gain by it, all
  // groups get all the samples there are.
  void lower();
  double level() const { return level_; }

  // How many rounds each tile has at this level; only when settled.
  std::vector<RoundIndex> ends() const;
  double mean_spp() const;  // over pixels

  // Some group has all the samples there are.
  bool bound() const;
  // More samples for each tile than before; only while !bound(): with more a group would have decided
  // otherwise.
  void extend(std::uint64_t spp);

  // ---- what will probably be wanted, to have it rendered in time; decides no pixel ----
  // Looks ahead to the level at which the image will be down to `target`. Nothing is foreseen before every
  // group has kFirstForecast rounds.
  void foresee(double target);
  // Rounds of the tile that will probably be wanted; never fewer than those that surely are.
  RoundIndex foreseen(TileIndex tile) const;
  // Of the tile's group, per sample, as told by its last round: with it, in whole rounds, the rule's order of
  // gains can be foretold. NaN: not known.
  double variance(TileIndex tile) const;
  // Samples of all pixels that these still lack; nothing: not foreseen yet.
  std::optional<double> samples_left() const;
  double samples_to_limit() const;                            // that all pixels lack to the most there are
  std::uint64_t rounds_seen() const { return rounds_seen_; }  // of all groups
  std::size_t groups() const { return groups_.size(); }

 private:
  struct Group {
    std::vector<TileIndex> tiles;
    double pixels = 0;
    std::vector<double> sums;  // of the group's tiles, by round, in tile order
    RoundIndex stop = 0;       // no earlier round was the last one
    RoundIndex foreseen = 0;   // probably the last one
    bool settled = false;      // and it is this one, at this level
  };
  double variance(const Group& g, RoundIndex round) const;        // per sample, as told by rounds 0..round
  double samples_lacking(const Group& g, RoundIndex last) const;  // of its pixels, with rounds up to this one
  double gain(const Group& g) const;                              // of one more round after `stop`
  double measured() const;  // relMSE with the last rounds, which must be known
  static bool whole(const Group& g) { return g.sums.size() > g.stop; }
  void advance(Group& g);

  TileGrid grid_;
  std::uint64_t spp_;
  RoundIndex last_;  // of all rounds there are
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_of_;
  std::vector<std::vector<double>> waiting_;  // of each tile: errors of rounds that its group has not got yet
  std::size_t settled_ = 0;
  double level_ = std::numeric_limits<double>::infinity();
  std::uint64_t rounds_seen_ = 0;
  bool foreseen_ = false;
};

}  // namespace ls::coordinator
