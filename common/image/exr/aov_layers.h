// The AOVs of a film as layers of the final EXR.
#pragma once

#include <cstdint>
#include <string>

#include "common/image/exr/exr_file.h"
#include "common/image/film/film.h"

namespace ls {

// Cryptomatte manifests of the identifier layers (cryptomatte.h); empty: no manifest.
struct CryptomatteManifests {
  std::string shapes, materials;
};

// Number of identifiers per pixel, those with the largest coverage: three layers of four channels.
inline constexpr int kCryptomatteRanks = 6;

// Returns the name of a layer: that of the AOV, or "crypto_object", "crypto_material".
std::string layer_of(Aov aov);

// Adds the film's AOVs to `picture`: channels NAME.R, NAME.X, ... and, for identifiers, NAME00.R to NAME02.A
// with their header strings. Pixels without a surface are 0 in the AOVs of surfaces (AovKind::of_hits,
// of_all and ids). Returns the number of values whose magnitude exceeded 65504, the largest half.
std::uint64_t add_aov_layers(const Film& film, const CryptomatteManifests& manifests, bool float_output,
                             ExrPicture& picture);

// Clamps the values to at most 65504, the largest half, in magnitude; returns the number of clamped values.
std::uint64_t clamp_to_half(std::vector<float>& plane);

}  // namespace ls
