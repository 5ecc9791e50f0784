// What a scene makes use of, and what it leaves out, in words: for the report. A function of the scene alone.
#pragma once

#include <string>
#include <vector>

#include "common/scene/scene.h"

namespace ls::coordinator {

struct SceneFeatures {
  std::vector<std::string> used, left_out;
};
SceneFeatures features_of(const Scene& scene);

}  // namespace ls::coordinator
