// Coverage of images as users render them: whole jobs of a scene file, with the integrator's defaults, never
// paired anew from halves. Pixels that share paths or light vertices stay as correlated as they are.
//
// A job's first rounds are those of a job with fewer samples (rounds.h), so one render of many samples is an
// image of every smaller number of samples, too.
//
// Renders cost time, so their halves are used several times. The two halves of an image are independent, and
// what pixels have in common (shared paths, sets of light vertices) they have in common within a half. So
// the first half of one image and the second half of another are an image, too. Image i is paired with the
// images i, i + 1, ... (cyclically). Pairs that have an image in common are not independent: the standard
// errors are from leaving out one image at a time, with all of its pairs (the jackknife; Arvesen 1969 for
// means over pairs).
//
// The right answer for a pair is the mean of all other images at their full number of samples; the noise of
// that mean is known from the scatter of their halves. Its square is subtracted from squared errors, and the
// interval of the image's mean is wider by as much as this noise makes the distance of the two means.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/image/frame/frame.h"
#include "tests/coverage/coverage.h"

namespace ls::test {

struct RenderedJobs {
  std::string scene;  // path of the scene file
  FrameSize size{64, 64};
  std::uint64_t spp = 64;  // every image is looked at after 4, 8, 16, ... samples up to this number
  int images = 100;        // number of renders, at least 3
  int pairs = 1;           // each image's first half is paired with the second halves of so many images
  int threads = 2;
  std::uint64_t first_seed = 1;
  // Folder that keeps the renders: an image that is there is read, the others are rendered and written there,
  // so that estimators can be compared on the same images. "": none. To be emptied when the renderer or the
  // scene has changed.
  std::filesystem::path kept;
};

// How many of the stated intervals hold.
struct Held {
  int stated = 0;    // number of trusted images that state the interval
  double share = 0;  // part of them whose interval holds the true figure
  double above = 0;  // part of them whose true figure is above the interval
  double sigma = 0;  // standard error of `share`
};

// Compares the stated errors of all pairs with one number of samples with their true errors.
struct RenderedCell {
  std::uint64_t spp = 0;
  int images = 0;   // number of pairs
  int trusted = 0;  // pairs whose verdict is not "don't trust yet"
  // relMSE, RMSE, the mean of green over the image, and the relMSE of means over squares of 16 x 16 pixels
  Held relmse, rmse, mean, squares;
  double true_relmse = 0;         // mean over all pairs
  Ratio mse_ratio, relmse_ratio;  // mean estimated / mean true, over all pairs
};

// Throws std::runtime_error if the scene cannot be read or rendered, or a kept image is of another size.
std::vector<RenderedCell> measure_rendered(const RenderedJobs& jobs);

std::string rendered_head();  // of the table
std::string rendered_line(const RenderedJobs& jobs, const RenderedCell& cell);

}  // namespace ls::test
