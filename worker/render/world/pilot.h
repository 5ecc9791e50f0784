// Renders some camera paths and rays before the first sample, to learn which techniques pay for a scene, that
// is, reduce its noise by more than they cost. The results depend only on the scene and the size of the full
// frame, not on the seed, the number of samples, a crop or the number of threads. The world must be otherwise
// complete, and is the same afterwards.
#pragma once

#include <optional>
#include <vector>

#include "worker/render/world/world.h"

namespace ls::render {

// Sets the seed of a pilot in the world, and limits the length of paths to `max_depth` segments. The
// destructor restores the world's own values.
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

// False if the frame is too small to be worth a pilot's pixels. Also false if the scene has many shapes that
// light passes straight through, because a single path may then take as long as a whole image of another
// scene.
bool pilot_pays(const World& w);

// Returns the mean radiance, over the channels, of camera paths of at most `max_depth` segments at random
// places of the full frame. Returns nullopt if the frame is too small to be worth these paths.
std::optional<double> pilot_radiance(World& w, int max_depth);

// The mean and the variance of the samples of one pixel
struct PilotPixel {
  V3d mean{0, 0, 0}, variance{0, 0, 0};
};
// Renders pixels at random places of the full frame, the same ones in each call, by paths of at most
// `max_depth` segments. Returns an empty vector if a sample was rejected.
std::vector<PilotPixel> pilot_pixels(World& w, int max_depth, int threads);
// True if the noise of `a`, as relMSE, is more than `factor` times that of `b`. Both are the same pixels
// rendered in two ways; false if one of them is empty. Both noises are weighted by the mean of the two
// results, so that a rare bright sample lowers the weight of its pixel in both and does not decide alone.
bool is_noisier(const std::vector<PilotPixel>& a, const std::vector<PilotPixel>& b, double factor);

// Mean probabilities that media scatter or absorb a camera ray before it hits a surface.
struct CameraCollisions {
  float all = 0;  // over all camera rays
  float met = 0;  // over the rays with a probability above 1e-3; 0 if there are none
};

// Computes the means over a lattice of camera rays of the full frame, of which the image may be a crop. Where
// media overlap, only one of them counts at each place.
CameraCollisions camera_collisions(const World& w);

}  // namespace ls::render
