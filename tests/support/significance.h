// ONE rate of false alarms for the whole suite: the probability that a correct program fails any statistical
// test of it is at most kSuiteFalsePositives. The rate is split among families of tests (by Bonferroni, since
// families may use the same numbers), and a family's part evenly among its tests (by Sidak). Seeds are fixed,
// so a program either always fails a test or never does. The rate is the probability that a harmless change
// of random numbers looks like a fault.
//
// Each family reads its level from here. Test files of the families in kShares declare the number of their
// tests, and check at their end that they ran no more.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

#include "validation/measure/hypothesis_tests.h"

namespace ls::test {

inline constexpr double kSuiteFalsePositives = 1e-3;

enum class Family {
  table,          // `lightshaft validate --quick`: one run, tests/system/test_validation_table.py
  closed_forms,   // tests/statistical
  chi_square,     // samples against densities: unit tests of sampling, bsdf and render
  scenes,         // the same image by other means: tests/property
  coverage,       // estimated errors against true ones: tests/coverage
  single_figures  // means with a tolerance of at least kStandardErrors standard errors: other unit tests
};
struct Rate {
  Family family;
  double rate;
};
// The rates of table and closed_forms are the product's own (validation/measure/judge.h). Test files
// passed to `lightshaft validate` have the level that they state, .01 by default: they are not included here.
inline constexpr std::array kRates = {Rate{Family::table, 2e-4},      Rate{Family::closed_forms, 2e-4},
                                      Rate{Family::chi_square, 1e-4}, Rate{Family::scenes, 1e-4},
                                      Rate{Family::coverage, 1e-4},   Rate{Family::single_figures, 2e-4}};

constexpr double rate_of(Family family) {
  for (const Rate& r : kRates)
    if (r.family == family) return r.rate;
  return 0;
}
constexpr double sum_of_rates() {
  double sum = 0;
  for (const Rate& r : kRates) sum += r.rate;
  return sum;
}
// up to rounding of the sum
static_assert(sum_of_rates() <= kSuiteFalsePositives * (1 + 1e-12));

// A single mean deviates by this many of its standard errors by chance once in 1.7 million times. These tests
// are not counted: 300 of them would use up 1.7e-4.
inline constexpr double kStandardErrors = 5;
// That probability, for means whose standard errors have few degrees of freedom.
inline constexpr double kSingleFigure = 5.73e-7;

// The largest tolerance of a test that a technique keeps the expected image, as a part of the image: a bias
// of twice this is found with a probability of nearly 1, and one of this in half of the cases. A test that is
// noisier has no power and fails.
inline constexpr double kBiasSeen = .005;

struct Share {
  Family family;
  std::string_view file;
  int tests;
};
inline constexpr std::array kShares = {Share{Family::chi_square, "bsdf/sampling", 240},
                                       Share{Family::chi_square, "sampling/phases", 20},
                                       Share{Family::chi_square, "sampling/other_phases", 36},
                                       Share{Family::chi_square, "sampling/lights", 18},
                                       Share{Family::chi_square, "sampling/choice", 13},
                                       Share{Family::chi_square, "sampling/distances", 58},
                                       Share{Family::chi_square, "sampling/film", 8},
                                       Share{Family::chi_square, "sampling/glow_points", 15},
                                       Share{Family::chi_square, "sampling/emissive_grids", 10},
                                       Share{Family::chi_square, "render/envmap", 6},
                                       Share{Family::chi_square, "render/trackers", 1},
                                       Share{Family::chi_square, "render/cylinder", 1},
                                       Share{Family::coverage, "coverage/short", 4 * 7},
                                       Share{Family::coverage, "coverage/rendered", 2},
                                       Share{Family::coverage, "coverage/target", 3},
                                       Share{Family::coverage, "coverage/mixes", 4},
                                       Share{Family::coverage, "coverage/fireflies", 1},
                                       Share{Family::coverage, "coverage/denominators", 24},
                                       Share{Family::scenes, "property/agreement", 180},
                                       Share{Family::scenes, "property/lamps", 6},
                                       Share{Family::scenes, "property/mirrors", 6},
                                       Share{Family::scenes, "property/connections", 27},
                                       Share{Family::scenes, "property/lit_disk", 1},
                                       Share{Family::scenes, "property/path_reuse", 228},
                                       Share{Family::scenes, "property/path_reuse_mean", 12},
                                       Share{Family::scenes, "property/sky_portals", 13 * 12},
                                       Share{Family::scenes, "property/local_lights", 13 * 12},
                                       Share{Family::scenes, "property/emissive_grids", 12 * 12},
                                       Share{Family::scenes, "property/light_tree", 12},
                                       Share{Family::scenes, "property/two_sided", 8 * 12},
                                       Share{Family::scenes, "property/camera_motion", 7 * 12},
                                       Share{Family::scenes, "property/shape_motion", 12 * 12},
                                       Share{Family::scenes, "property/pruned", 720},
                                       Share{Family::scenes, "property/twins", 120},
                                       Share{Family::scenes, "property/shared_faces", 24},
                                       Share{Family::scenes, "property/hair", 12},
                                       Share{Family::scenes, "property/scaling", 60},
                                       Share{Family::scenes, "property/shifting", 60},
                                       Share{Family::scenes, "property/turning", 60},
                                       Share{Family::scenes, "property/two_halves", 60},
                                       Share{Family::scenes, "property/channels", 60},
                                       Share{Family::scenes, "property/sum_of_lights", 60},
                                       Share{Family::scenes, "property/light_groups", (8 + 5) * 2 * 3},
                                       Share{Family::scenes, "property/light_mixes", 8 * 3},
                                       Share{Family::scenes, "property/twice_the_grid", 6},
                                       Share{Family::scenes, "property/majorant", 6},
                                       Share{Family::scenes, "property/boundaries", 60},
                                       Share{Family::scenes, "property/both_ways", 12}};

constexpr std::size_t tests_of(Family family) {
  std::size_t n = 0;
  for (const Share& s : kShares)
    if (s.family == family) n += static_cast<std::size_t>(s.tests);
  return n;
}
inline double level_of_one(Family family) { return cli::sidak(rate_of(family), tests_of(family)); }

// The tests of one line of kShares, counted when they request their level.
class Tests {
 public:
  explicit Tests(std::string_view file) : file_(file) {
    for (const Share& s : kShares)
      if (s.file == file) share_ = s;
    EXPECT_GT(share_.tests, 0) << file << ": put it into kShares";
  }
  Tests(const Tests&) = delete;
  Tests& operator=(const Tests&) = delete;

  // Returns the probability with which each of `count` more tests may fail for a correct program.
  double level(int count = 1) {
    done_ += count;
    return level_of_one(share_.family);
  }
  int done() const { return done_; }
  int announced() const { return share_.tests; }
  // Call when all tests are done.
  void close() const {
    EXPECT_LE(done_, share_.tests) << "tests of " << file_ << ": put the number into kShares";
    std::printf("[  level   ] %s: %d tests at %.3g\n", std::string(file_).c_str(), done_,
                level_of_one(share_.family));
  }

 private:
  std::string_view file_;
  Share share_{};
  int done_ = 0;
};

}  // namespace ls::test
