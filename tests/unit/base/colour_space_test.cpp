#include "core/base/light/colour_space.h"

#include <gtest/gtest.h>

#include <cmath>

namespace ls {
namespace {

void expect_near(const ColourMatrix& m, const std::array<double, 9>& wanted, double tolerance) {
  for (std::size_t i = 0; i < 9; ++i)
    EXPECT_NEAR(m(i / 3, i % 3), wanted[i], tolerance) << "row " << i / 3 << ", column " << i % 3;
}

// The tolerances are half a unit of the last published digit; for ACES, whose matrices are published with
// many digits of whites rounded otherwise, what a change of the last digit of a white does.
TEST(ColourSpace, MatricesAreThePublishedOnes) {
  // IEC 61966-2-1
  expect_near(from_rec709(ColourSpace::xyz), {.4124, .3576, .1805, .2126, .7152, .0722, .0193, .1192, .9505},
              5e-5);
  // ITU-R BT.2087-0
  expect_near(from_rec709(ColourSpace::rec2020),
              {.6274, .3293, .0433, .0691, .9195, .0114, .0164, .0880, .8956}, 5e-5);
  // The configurations of OpenColorIO for ACES: from linear Rec. 709 to ACEScg, and to ACES2065-1
  expect_near(from_rec709(ColourSpace::acescg),
              {.613097402, .339523146, .047379451, .070193722, .916353879, .013452398, .020615593, .109569773,
               .869814634},
              1e-6);
  expect_near(from_rec709(ColourSpace::aces2065_1),
              {.439632982, .382988698, .177378321, .089776443, .813439429, .096784128, .017541170, .111546553,
               .870912277},
              1e-6);
}

TEST(ColourSpace, WhiteStaysWhiteAndBackIsTheInverse) {
  for (const ColourSpace space : colour_spaces()) {
    const ColourMatrix to = from_rec709(space);
    const Tristimulus white = to * Tristimulus{1, 1, 1}, back = inverse(to) * (to * Tristimulus{.2, .5, .9});
    // Products of three matrices whose entries are of the order 1 to 10: some 1e-15 times that
    for (const std::size_t k : {0, 1, 2}) {
      EXPECT_NEAR(back[k], (Tristimulus{.2, .5, .9})[k], 1e-13) << to_string(space);
      if (space != ColourSpace::xyz) EXPECT_NEAR(white[k], 1, 1e-13) << to_string(space);
    }
  }
  const Tristimulus d65 = from_rec709(ColourSpace::xyz) * Tristimulus{1, 1, 1};
  EXPECT_NEAR(d65[0], .3127 / .3290, 1e-13);
  EXPECT_NEAR(d65[2], (1 - .3127 - .3290) / .3290, 1e-13);
}

TEST(ColourSpace, PrimariesOfNoSpaceGiveNoFiniteMatrix) {
  const Chromaticity one{.3, .3};
  EXPECT_FALSE(std::isfinite(to_xyz({one, one, one, one})(0, 0)));
}

}  // namespace
}  // namespace ls
