// Many small independent jobs of one scene: how often is the error within the interval that the job states,
// and is the estimate right in the mean?
//
// The right answer is the mean of all other jobs' images. It is independent of a job's image x, and its own
// noise is known: with n others its variance is v / n, v the variance among jobs, and is subtracted:
//   e^2 = (x - mean of others)^2 - v / n.
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

struct Coverage {
  int jobs = 0;
  double spp = 0;                 // mean over pixels and jobs
  double rmse = 0, relmse = 0;    // share of jobs whose interval holds the true figure
  Ratio mse_ratio, relmse_ratio;  // mean estimated / mean true
  double true_relmse = 0;         // mean
  double heavy_tail = 0;          // share of jobs that say "don't trust yet"
};

// `jobs` of them, with seeds from `first` on (job.h). Throws std::runtime_error on a scene that cannot be
// read.
Coverage measure_coverage(const CoverageScene& scene, int jobs, int threads, std::uint64_t first = 1);

std::string coverage_line(const CoverageScene& scene, const Coverage& c);  // for tables
// Whether what docs/error.md promises holds: 93 to 97 % covered and ratios within 3 %; of fireflies that 95 %
// of the jobs say so. Fewer jobs than 1,000 are held to it as they are.
bool as_promised(const CoverageScene& scene, const Coverage& c);

}  // namespace ls::test
