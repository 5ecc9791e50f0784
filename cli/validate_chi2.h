// Pearson's test that a bsdf draws directions with the density that it claims.
#pragma once

#include <cstdint>

#include "cli/validate_table.h"
#include "common/base/error.h"
#include "common/scene/nori_test.h"
#include "worker/render/render.h"

namespace ls::cli {

// test.bsdfs[bsdf], seen from a direction that `seed` chooses. expected: the degrees of freedom; got: the
// statistic; standard_error: that of the statistic of a right sampler; z: how far off it is in those. p is
// filled, the verdict is left to the caller but where the density itself is wrong: more than 1 in all, or
// samples where there is none. invalid_argument: a bsdf that the renderer refuses, or none but delta lobes.
Result<ValidateCase> chi2_case(const NoriTest& test, std::size_t bsdf, const render::AssetFiles& files,
                               std::uint64_t seed);

}  // namespace ls::cli
