// Runs the tests of a Nori file (a <test> element) as cases.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/scene/reader/nori_test.h"
#include "validation/measure/judge.h"
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

// Pearson's chi-square test of whether a BSDF samples directions with the density that its pdf returns.
// Tests test.bsdfs[bsdf] for an outgoing direction that depends on `seed`. In the result, `expected` is the
// number of degrees of freedom, `got` the statistic, `standard_error` the statistic's standard deviation for
// a correct sampler, and `z` the deviation in these units. `p` is the probability of such a deviation; the
// caller judges it. The case has failed already (`why` is set) if the density itself is wrong: its integral
// is more than 1, or samples lie where it is 0. invalid_argument: the renderer rejects the bsdf, or it has
// delta lobes only.
Result<ValidateCase> chi2_case(const NoriTest& test, std::size_t bsdf, const render::AssetFiles& files,
                               std::uint64_t seed);

}  // namespace ls::cli
