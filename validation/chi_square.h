// Pearson's chi-square test that a bsdf samples directions with the density that it claims.
#pragma once

#include <cstdint>

#include "common/base/error.h"
#include "common/scene/reader/nori_test.h"
#include "validation/result_table.h"
#include "worker/render/render.h"

namespace ls::cli {

// Tests test.bsdfs[bsdf], seen from a direction that `seed` chooses. expected: the degrees of freedom; got:
// the statistic; standard_error: that of the statistic for a correct sampler; z: the deviation in these
// units. Fills p; the caller judges, except where the density itself is wrong: more than 1 in total, or
// samples where it is 0. invalid_argument: a bsdf that the renderer rejects, or with delta lobes only.
Result<ValidateCase> chi2_case(const NoriTest& test, std::size_t bsdf, const render::AssetFiles& files,
                               std::uint64_t seed);

}  // namespace ls::cli
