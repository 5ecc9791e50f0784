// Runs the tests that a Nori file describes in a <test> element. Each test gives one or more cases of the
// report of `lightshaft validate`.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "formats/reader/nori_test.h"
#include "validation/measure/judge.h"
#include "worker/render/render.h"

namespace ls::cli {

struct ValidateOptions {
  int threads = 1;
  std::uint64_t seed = 0;
  std::string only;  // only cases whose names contain this text are run; empty: all
  std::function<void(const ValidateCase&)> done = {};  // called with each case when it is done
};

// Runs every case and judges it. The significance level that the file states is for all its cases together.
// Returns an error if a scene or file cannot be rendered.
Result<std::vector<ValidateCase>> validate_test(const NoriTest& test, const render::AssetFiles& files,
                                                const ValidateOptions& options);

// Returns a scene that measures the mean weight, f cos / pdf, of the samples of a BSDF: the surface of `bsdf`
// in an environment of radiance 1, seen by a camera at `degrees` from the normal, with paths of two segments.
// The radiance of the surface is then the mean weight.
Scene albedo_scene(const Scene& bsdf, double degrees);

// Pearson's chi-square test of whether the BSDF of the scene test.bsdfs[bsdf] samples directions with the
// density that its pdf returns, for an outgoing direction that depends on `seed`. In the result, `expected`
// is the number of degrees of freedom, `got` the statistic, `standard_error` the standard deviation of the
// statistic for a correct sampler, and `z` the deviation in units of `standard_error`. `p` is the probability
// of such a deviation; the caller compares it with the significance level. The case has failed already (`why`
// is set) if the density itself is wrong: its integral is more than 1, or samples lie where it is 0. Error
// invalid_argument: the renderer rejects the BSDF, or it has delta lobes only.
Result<ValidateCase> chi2_case(const NoriTest& test, std::size_t bsdf, const render::AssetFiles& files,
                               std::uint64_t seed);

}  // namespace ls::cli
