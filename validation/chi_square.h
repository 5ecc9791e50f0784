// Pearson's chi-square test of whether a BSDF samples directions with the density that its pdf returns.
#pragma once

#include <cstdint>

#include "common/base/error.h"
#include "common/scene/reader/nori_test.h"
#include "validation/result_table.h"
#include "worker/render/render.h"

namespace ls::cli {

// Tests test.bsdfs[bsdf] for an outgoing direction that depends on `seed`. In the result, `expected` is the
// number of degrees of freedom, `got` the statistic, `standard_error` the statistic's standard deviation for
// a correct sampler, and `z` the deviation in these units. `p` is the probability of such a deviation; the
// caller judges it. The case has failed already (`why` is set) if the density itself is wrong: its integral
// is more than 1, or samples lie where it is 0. invalid_argument: the renderer rejects the bsdf, or it has
// delta lobes only.
Result<ValidateCase> chi2_case(const NoriTest& test, std::size_t bsdf, const render::AssetFiles& files,
                               std::uint64_t seed);

}  // namespace ls::cli
