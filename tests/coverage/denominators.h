// Made-up pictures with known noise: is the relative error biased by the noise that stands in its
// denominator, or by what takes the right value's place there?
#pragma once

#include <string>
#include <vector>

#include "tests/coverage/coverage.h"

namespace ls::test {

struct DenominatorRow {
  std::string picture;
  double relmse = 0;      // the right one, of the noise given
  Ratio ours;             // mean estimated / mean true
  double own = 0;         // the same with the image's own pixel in the denominator
  double neighbours = 0;  // and with the mean of its 5 x 5 neighbours
};

// Pictures of 32 x 32 grey pixels, black to bright, flat and with edges, at several strengths of Gaussian
// noise; `trials` of each.
std::vector<DenominatorRow> measure_denominators(int trials);

std::string denominator_line(const DenominatorRow& row);

}  // namespace ls::test
