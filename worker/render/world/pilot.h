// Renders some camera paths before the first sample, to learn which techniques pay for a scene. What they
// tell is always the same for a scene and a size of the frame: the seed, the number of samples, a crop and
// the number of threads have no part in it. The world is otherwise complete, and is the same afterwards.
#pragma once

#include <optional>
#include <vector>

#include "worker/render/world/world.h"

namespace ls::render {

// Sets a pilot's seed and its longest paths in the world; the destructor restores the world's own.
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

// False for frames that are too small to be worth a pilot's pixels, and for scenes with so many shapes that
// light passes that a single path may take as long as the image of another scene.
bool pilot_pays(const World& w);

// The mean radiance, over the channels, of camera paths at random places of the full frame that end after at
// most `max_depth` segments. nullopt for frames that are not worth the paths.
std::optional<double> pilot_radiance(World& w, int max_depth);

// The mean and the variance of the samples of one pixel
struct PilotPixel {
  V3d mean{0, 0, 0}, variance{0, 0, 0};
};
// The same pixels at random places of the full frame for each call, by paths of at most `max_depth` segments.
// Empty if a sample was rejected.
std::vector<PilotPixel> pilot_pixels(World& w, int max_depth, int threads);
// True if the noise of `a`, in the sense of relMSE, is more than `factor` times that of `b`. Both are the
// same pixels rendered in two ways; false if one of them is empty. A rare bright sample makes its pixel count
// less in both, so that it does not decide alone.
bool is_noisier(const std::vector<PilotPixel>& a, const std::vector<PilotPixel>& b, double factor);

}  // namespace ls::render
