// Coverage of images as users render them: whole jobs of a scene file, with the integrator's defaults, never
// paired anew from halves. Pixels that share paths or light vertices stay as correlated as they are.
//
// A job's first rounds are those of a job with fewer samples (rounds.h), so one render of many samples is an
// image of every smaller number of samples, too. The right answer for an image is the mean of all other
// images at their full number of samples; the noise of that mean is known from their scatter, and its square
// is subtracted.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/image/frame/frame.h"
#include "tests/coverage/coverage.h"

namespace ls::test {

struct RenderedJobs {
  std::string scene;  // path of the scene file
  FrameSize size{64, 64};
  std::uint64_t spp = 64;  // every image is looked at after 4, 8, 16, ... samples up to this number
  int images = 100;
  int threads = 2;
  std::uint64_t first_seed = 1;
  std::string dump;  // file to which the half means after each round are written as float64; "": none
};

// Compares the stated errors of all images with one number of samples with their true errors.
struct RenderedCell {
  std::uint64_t spp = 0;
  int images = 0;
  int trusted = 0;           // images whose verdict is not "don't trust yet"
  int rmse_known = 0;        // of the trusted ones, those with an interval of RMSE
  int rmse = 0, relmse = 0;  // of the trusted ones, those whose interval holds the true figure
  // of the trusted ones, those whose interval holds the mean of green over the image, and the relMSE of means
  // over squares of 16 x 16 pixels
  int mean = 0, squares = 0;
  int mean_known = 0, squares_known = 0;  // of the trusted ones, those with these intervals
  double true_relmse = 0;                 // mean over all images
  Ratio mse_ratio, relmse_ratio;          // mean estimated / mean true, over all images
};

// Throws std::runtime_error if the scene cannot be read or rendered.
std::vector<RenderedCell> measure_rendered(const RenderedJobs& jobs);

std::string rendered_line(const RenderedJobs& jobs, const RenderedCell& cell);  // for tables

}  // namespace ls::test
