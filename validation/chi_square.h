// Pearson's chi-square test that a bsdf samples directions with the density that it claims.
#pragma once

#include <cstdint>

#include "common/base/error.h"
#include "common/scene/reader/nori_test.h"
#include "validation/result_table.h"
#include "worker/render/render.h"

namespace ls::cli {

// Tests test.bsdfs[bsdf], seen from a direction that `seed` chooses. In the result, `expected` is the degrees
// of freedom, `got` the statistic, `standard_error` the standard deviation of the statistic for a correct
// sampler, and `z` the deviation in these units. Fills `p`, the probability of such a deviation, which the
// caller judges, except where the density itself is wrong: its integral is more than 1, or there are samples
// where it is 0. invalid_argument: the renderer rejects the bsdf, or it has delta lobes only.
Result<ValidateCase> chi2_case(const NoriTest& test, std::size_t bsdf, const render::AssetFiles& files,
                               std::uint64_t seed);

}  // namespace ls::cli
