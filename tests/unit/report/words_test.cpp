#include "common/report/words.h"

#include <gtest/gtest.h>

#include <limits>

namespace ls::report {
namespace {

TEST(Words, FiguresHaveThreeDigits) {
  EXPECT_EQ(figure(0), "0");
  EXPECT_EQ(figure(0.0213), "0.0213");
  EXPECT_EQ(figure(0.00418), "0.00418");
  EXPECT_EQ(figure(1234), "1,230");
  EXPECT_EQ(figure(3.2e-5), "3.20 × 10⁻⁵");
  EXPECT_EQ(figure(-7e12), "-7.00 × 10¹²");
}

TEST(Words, AFigureThatRoundsUpToAPowerOfTenHasItsDigits) {
  EXPECT_EQ(figure(9.996), "10.0");
  EXPECT_EQ(figure(0.0009999), "0.00100");
  EXPECT_EQ(figure(99999), "1.00 × 10⁵");
}

TEST(Words, WhatIsNotKnownIsADash) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& text :
       {figure(nan), given(nan), duration(nan), count(nan), byte_size(nan), percent(nan), date_time(nan)})
    EXPECT_EQ(text, "–");
}

TEST(Words, GivenFiguresKeepTheirDigits) {
  EXPECT_EQ(given(0.001), "0.001");
  EXPECT_EQ(given(1e-5), "1.00 × 10⁻⁵");
}

TEST(Words, DurationsAreInTheUnitThatFits) {
  EXPECT_EQ(duration(0.42), "0.4 s");
  EXPECT_EQ(duration(9.96), "10 s");
  EXPECT_EQ(duration(59), "59 s");
  EXPECT_EQ(duration(252), "4.2 min");
  EXPECT_EQ(duration(4310), "1 h 12 min");
  EXPECT_EQ(duration(273600), "3 d 4 h");
}

TEST(Words, CountsAndSizesAreGrouped) {
  EXPECT_EQ(count(39321600), "39,321,600");
  EXPECT_EQ(count(999), "999");
  EXPECT_EQ(byte_size(36347904), "34.7 MiB");
  EXPECT_EQ(byte_size(12), "12 B");
}

TEST(Words, SamplesAreCountedNotAbout) {
  EXPECT_EQ(sample_count(1024), "1,024");
  EXPECT_EQ(sample_count(1025.996), "1,026") << "a mean over seeds";
  EXPECT_EQ(sample_count(5.657), "5.7");
  EXPECT_EQ(sample_count(63.99999999), "64");
  EXPECT_EQ(sample_count(std::numeric_limits<double>::quiet_NaN()), "–");
}

TEST(Words, NothingAndEverythingAloneAreZeroAndAHundredPercent) {
  EXPECT_EQ(percent(0), "0 %");
  EXPECT_EQ(percent(1e-6), "< 1 %") << "not 1 %: the parts of a whole would be more than it";
  EXPECT_EQ(percent(0.0049), "< 1 %");
  EXPECT_EQ(percent(0.0051), "1 %");
  EXPECT_EQ(percent(0.9949), "99 %");
  EXPECT_EQ(percent(0.9999), "> 99 %");
  EXPECT_EQ(percent(1), "100 %");
}

TEST(Words, DatesAreInUtc) { EXPECT_EQ(date_time(1765000000), "2025-12-06 05:46 UTC"); }

}  // namespace
}  // namespace ls::report
