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

inline constexpr int kCryptomatteRanks =
    6;  // identifiers per pixel, largest coverage first: three layers of four channels

// Returns the name of a layer: that of the AOV, or "crypto_object", "crypto_material".
std::string layer_of(Aov aov);

// Adds the film's AOVs to `picture`: channels NAME.R, NAME.X, ... and, for identifiers, NAME00.R to NAME02.A
// with their header strings. All are 0 in pixels without a surface. Returns the number of values that
// exceeded the largest half, 65504.
std::uint64_t add_aov_layers(const Film& film, const CryptomatteManifests& manifests, bool float_output,
                             ExrPicture& picture);

// Clamps the values to +-65504, the largest half; returns the number of clamped values.
std::uint64_t clamp_to_half(std::vector<float>& plane);

}  // namespace ls
