// Pilots: some camera paths and rays that are traced before the first sample, to learn which techniques pay
// for a scene, that is, reduce its noise by more than they cost. The results depend only on the scene and the
// size of the full frame, not on the seed, the number of samples, a crop or the number of threads. The world
// must be otherwise complete, and it is the same after a pilot as before.
#pragma once

#include <optional>
#include <vector>

#include "worker/render/world/world.h"

namespace ls::render {

// Prepares the world w for a pilot: sets its seed, and limits paths to max_depth segments. The destructor
// restores the world's own seed and limit.
class PilotSettings {
 public:
  PilotSettings(World& w, std::uint64_t seed, int max_depth);
  PilotSettings(const PilotSettings&) = delete;
  PilotSettings& operator=(const PilotSettings&) = delete;
  ~PilotSettings();

 private:
  World& w_;
  const std::uint64_t seed_;
  const int max_depth_;
};

// False if pilot_pixels() would cost too much: if the frame is small compared with the pixels of a pilot, or
// if the scene has many shapes that light passes straight through, because a single path may then take as
// long as a whole image of another scene.
bool pilot_pays(const World& w);

// Returns the mean radiance (mean of the channels) of camera paths of at most `max_depth` segments at random
// places of the full frame. Returns nullopt if the frame is too small to be worth these paths.
std::optional<double> pilot_radiance(World& w, int max_depth);

// For each channel, the mean and the variance of the samples of one pixel.
struct PilotPixel {
  V3d mean{0, 0, 0}, variance{0, 0, 0};
};
// Renders pixels at random places of the full frame, which are the same in each call. Paths have at most
// `max_depth` segments. Returns an empty vector if a sample was rejected.
std::vector<PilotPixel> pilot_pixels(World& w, int max_depth, int threads);
// Compares two renderings of the same pixels, `a` and `b`: true if the noise of `a` is more than `factor`
// times that of `b`; false if one of them is empty. The noise is the relMSE: the sum of the pixels'
// variances, each divided by the square of the pixel's value plus a small constant. For both renderings the
// value is the mean of the two, so that a rare bright sample in one of them lowers the weight of its pixel in
// both and does not decide the comparison.
bool is_noisier(const std::vector<PilotPixel>& a, const std::vector<PilotPixel>& b, double factor);

// Mean probabilities with which media scatter or absorb a camera ray before it hits a surface.
struct CameraCollisions {
  float all = 0;  // mean over all camera rays
  float met = 0;  // mean over the rays whose probability is above 1e-3; 0 if there are none
};

// Computes the means from a lattice of camera rays that covers the full frame, of which the image may be a
// crop. Where media overlap, only one of them is taken into account.
CameraCollisions camera_collisions(const World& w);

}  // namespace ls::render
