// Many small independent jobs of one scene: how often is the error within the interval that the job states,
// and is the estimate right in the mean?
//
// The right answer is the mean of all other jobs' images. It is independent of a job's image x, and its own
// noise is known: with n others its variance is v / n, v the variance among jobs, and is subtracted:
//   e^2 = (x - mean of others)^2 - v / n.
// Few jobs say little of a share. But pixels are independent of each other, and so are their halves: a job
// whose every pixel takes its two halves from any two jobs is as good as a rendered one, and what is right
// for it is known without noise: the mean of all halves. So a hundred jobs make thousands, and the share that
// these cover is known as well as if they had been rendered; what is left is that a pixel's noise has 200
// values instead of all that it could have.
//
// Of jobs that stop at a target it is the mean of as many uniform images with other seeds: what the stop rule
// might do to all of its images alike would be part of their mean.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/coverage/scenes.h"

namespace ls::test {

struct Ratio {
  double value = 0;
  double sigma = 0;  // its standard error, from the scatter among jobs
};

// Of the means of pairs (estimated, true); its error by linearisation.
class Quotient {
 public:
  void add(double estimated, double real) { pairs_.emplace_back(estimated, real); }
  Ratio ratio() const;

 private:
  std::vector<std::pair<double, double>> pairs_;
};

// Of n jobs.
struct Shares {
  int jobs = 0;
  int rmse_stated = 0;          // those that state an interval of RMSE (ImageError)
  double rmse = 0, relmse = 0;  // share whose interval holds the true figure; of RMSE among rmse_stated
};

struct Coverage {
  int jobs = 0;
  double spp = 0;  // mean over pixels and jobs
  // share of jobs whose interval holds the true figure, of RMSE among those that state one
  double rmse = 0, relmse = 0;
  Ratio mse_ratio, relmse_ratio;  // mean estimated / mean true
  double true_relmse = 0;         // mean
  double heavy_tail = 0;          // share of jobs that say "don't trust yet"
  Shares paired;                  // of jobs paired anew; none with a target
  Shares paired_narrow;           // the same jobs with intervals kNarrow times as wide
};

// What makes 95 % of a normal distribution 88 %: 1.55477 / 1.95996. A test of coverage must see it.
inline constexpr double kNarrow = .79326;

// `jobs` of them, with seeds from `first` on (job.h), and `paired` more of their halves. Throws
// std::runtime_error on a scene that cannot be read.
Coverage measure_coverage(const CoverageScene& scene, int jobs, int threads, std::uint64_t first, int paired);

std::string coverage_line(const CoverageScene& scene, const Coverage& c);  // for tables
// What docs/measurements/error.md promises of each row. Not every scene's noise is told of equally well by
// its last round: a share may be off by kMayBeOff, the mean of all rows by kMeanMayBeOff.
inline constexpr double kCovered = .95, kMayBeOff = .02, kMeanMayBeOff = .005;
inline constexpr double kRatioMayBeOff = .03;
inline constexpr double kWronglyDoubted = .05;  // of jobs without fireflies, "don't trust yet"

// How far from kCovered a share of n jobs may lie: by what it is allowed to be off, and by chance, with
// `level` for both sides.
double share_slack(int n, double level);
// Whether it holds; a row of an estimator that keeps its promise fails any of its figures with a probability
// of `level` each.
bool as_promised(const CoverageScene& scene, const Coverage& c, double level);

}  // namespace ls::test
