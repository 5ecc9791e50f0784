// Mixes of light groups: how often is the error of a mix within the interval that is stated for it, and is
// the estimate right in the mean?
//
// Images of one scene and many seeds; each is mixed with random factors several times. The right answer for a
// mix is the same mix of the means of all other images. Its own noise is known from the covariances of the
// groups among images, and its square is subtracted.
#pragma once

#include <cstdint>
#include <string>

#include "core/image/frame/frame.h"
#include "tests/coverage/coverage.h"

namespace ls::test {

struct MixJobs {
  std::string scene;  // path of a scene file with light groups
  FrameSize size{32, 32};
  std::uint64_t spp = 32;
  int images = 200;  // number of renders, at least 3
  int mixes = 10;    // of each image
  int threads = 2;
  std::uint64_t first_seed = 1;
};

struct MixCoverage {
  int mixes = 0;
  int trusted = 0;
  double held = 0;     // share of the trusted mixes whose interval of relMSE holds the true one
  Ratio relmse_ratio;  // mean estimated / mean true, over all mixes
};

// Throws std::runtime_error if the scene cannot be read or rendered.
MixCoverage measure_mixes(const MixJobs& jobs);
std::string mix_line(const MixJobs& jobs, const MixCoverage& c);  // for tables

}  // namespace ls::test
