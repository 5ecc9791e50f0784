// The tests of a Nori file, as cases.
#pragma once

#include <functional>
#include <vector>

#include "cli/validate_table.h"
#include "common/base/error.h"
#include "common/scene/nori_test.h"
#include "worker/render/render.h"

namespace ls::cli {

struct ValidateOptions {
  int threads = 1;
  std::uint64_t seed = 0;
  std::string only;                                    // a part of the names of the cases to run; empty: all
  std::function<void(const ValidateCase&)> done = {};  // called after each case
};

// Runs every case through the renderer; the significance of the whole file is shared by all of its cases. The
// error is that of a scene or file that can't be rendered.
Result<std::vector<ValidateCase>> validate_test(const NoriTest& test, const render::AssetFiles& files,
                                                const ValidateOptions& options);

// A bsdf's weights are what it shows of surroundings of radiance 1: the scene that a camera at this angle (in
// degrees from the normal) sees, paths of two segments.
Scene albedo_scene(const Scene& bsdf, double degrees);

}  // namespace ls::cli
