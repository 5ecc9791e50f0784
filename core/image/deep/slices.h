// The slices of a deep image: what the sums of a pixel say of them, and how they become the samples of a deep
// EXR. docs/decisions/0047-deep-images.md says why it is done in this way.
//
// A pixel has `count` slices, one behind the other, and a last record for what is infinitely far: the
// environment. Slice k begins at its edge E[k] and ends at E[k + 1]. The first slice also has what lies in
// front of it, the last one what lies behind it. The planes of a partial and of the film have for each record
//   B, G, R  the light that was first scattered, emitted or reflected in the slice, seen from the camera;
//   E        its edge, in the scene's units, counted as the AOV depth. Every unit states the same edge for a
//            pixel, so the mean over rounds is this edge. It is negative (its magnitude counts) if the slice
//            has a surface and nothing else. The record of what is infinitely far has the end of the last
//            slice as its edge;
//   T        the transmittance of the camera ray up to the end of the slice, mean of the three channels; of
//            the last record 1 - alpha, in which an environment that the camera sees is opaque.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/light/colour_space.h"
#include "core/image/aov/aov.h"

namespace ls {

// The depth that a deep image states for what is infinitely far.
inline constexpr double kDeepFar = 1e10;

// Where the planes of slices are, among all that a partial has of them.
class DeepPlanes {
 public:
  explicit constexpr DeepPlanes(DeepSlices slices) : slices_(slices) {}
  constexpr std::size_t records() const { return slices_.count > 0 ? slices_.count + std::size_t{1} : 0; }
  constexpr std::size_t count() const { return records() * per_record(); }
  // The planes of a record have the order of their letters: B E G R T, or E T.
  constexpr std::size_t light(std::size_t record, std::size_t c) const {
    constexpr std::size_t kPlace[] = {3, 2, 0};
    return record * per_record() + kPlace[c];
  }
  constexpr std::size_t edge(std::size_t record) const {
    return record * per_record() + (slices_.colours ? 1 : 0);
  }
  constexpr std::size_t transmittance(std::size_t record) const {
    return record * per_record() + per_record() - 1;
  }

 private:
  constexpr std::size_t per_record() const { return slices_.colours ? 5 : 2; }
  DeepSlices slices_;
};
// Returns "deep.00.B", ...: the names of the planes in the file of a partial, sorted.
std::vector<std::string> names_of_deep_planes(DeepSlices slices);
// Returns the slices whose planes are among `names`; there are none if no such plane is among them.
DeepSlices deep_slices_among(std::span<const std::string_view> names);

// One pixel of a deep image as its sums say it: means over all samples.
struct DeepPixel {
  std::vector<double> edges;          // for each record its edge, with its sign
  std::vector<double> transmittance;  // for each record
  // R, G, B of each record; empty if the slices have no colours
  std::vector<std::array<double, 3>> light;
};

// One sample of a pixel of a deep EXR. Its colour is multiplied by its own alpha, but not by the
// transmittance of the samples in front of it.
struct DeepSample {
  float z = 0, z_back = 0;
  float alpha = 0;
  std::array<float, 3> rgb{0, 0, 0};
  bool operator==(const DeepSample&) const = default;
};
// Returns the samples of a pixel, sorted by depth, none over another. Slices without light and alpha give no
// sample. Laid over each other from the front, the samples give the pixel's light, and 1 minus the last
// transmittance as alpha, up to the rounding of one number of the file. For this, each colour is computed from
// the alphas as they are rounded in the file. A slice that is seen through so little that its colour would not
// fit the file is joined to the one in front of it. `halves`: colours and alpha are stored as half floats.
// Any numbers give samples that a deep EXR may have: with alphas from 0 to 1, and finite.
std::vector<DeepSample> deep_samples(const DeepPixel& pixel, bool halves);

}  // namespace ls
