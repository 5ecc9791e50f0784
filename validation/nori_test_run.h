// Runs the tests of a Nori file (a <test> element) as cases.
#pragma once

#include <functional>
#include <vector>

#include "common/base/error.h"
#include "common/scene/reader/nori_test.h"
#include "validation/result_table.h"
#include "worker/render/render.h"

namespace ls::cli {

struct ValidateOptions {
  int threads = 1;
  std::uint64_t seed = 0;
  std::string only;  // runs only the cases whose names contain this; empty: all
  std::function<void(const ValidateCase&)> done = {};  // called after each case
};

// Renders every case. The cases share the significance level that the file states for all of them. Returns an
// error if a scene or file cannot be rendered.
Result<std::vector<ValidateCase>> validate_test(const NoriTest& test, const render::AssetFiles& files,
                                                const ValidateOptions& options);

// Returns a scene for measuring the weights of a bsdf, f cos / pdf: the bsdf's surface in an environment of
// radiance 1, seen by a camera at `degrees` from the normal, with paths of two segments. The radiance of the
// surface is then the mean weight.
Scene albedo_scene(const Scene& bsdf, double degrees);

}  // namespace ls::cli
