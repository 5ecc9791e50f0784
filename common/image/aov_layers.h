// The AOVs of a film as layers of the final EXR.
#pragma once

#include <cstdint>
#include <string>

#include "common/image/exr_file.h"
#include "common/image/film.h"

namespace ls {

// What a layer of identifiers says of the names behind them (cryptomatte.h); empty: nothing.
struct MatteManifests {
  std::string shapes, materials;
};

inline constexpr int kMatteRanks =
    6;  // identifiers of a pixel, the widest first: three layers of four channels

// The name of a layer: that of the AOV, or "crypto_object", "crypto_material".
std::string layer_of(Aov aov);

// Adds channels NAME.R, NAME.X, ... and, of identifiers, NAME00.R to NAME02.A with their header strings. Of a
// pixel without a surface all are 0. Returns how many values were beyond the largest half.
std::uint64_t add_aov_layers(const Film& film, const MatteManifests& manifests, bool float_output,
                             ExrPicture& picture);

// Clamps to +-65504, the largest half; how many values that were.
std::uint64_t clamp_to_half(std::vector<float>& plane);

}  // namespace ls
