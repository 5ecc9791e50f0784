// The slices of a deep image: the planes of sums that say what they are. docs/decisions/0047-deep-images.md
// says why it is done in this way.
//
// A pixel has `count` slices, one behind the other, and a last record for what is infinitely far: the
// environment. Slice k begins at its edge E[k] and ends at E[k + 1]. The first slice also has what lies in
// front of it, the last one what lies behind it. The planes of a partial and of the film have for each record
//   B, G, R  the light that was first scattered, emitted or reflected in the slice, seen from the camera;
//   E        its edge, in the scene's units, counted as the AOV depth. Every unit states the same edge for a
//            pixel, so the mean over rounds is this edge. It is negative if the slice has surfaces and
//            nothing else; its magnitude is then the depth of the surfaces, wherever the slice begins. The
//            record of what is infinitely far has the end of the last slice as its edge;
//   T        the transmittance of the camera ray up to the end of the slice, mean of the three channels; of
//            the last record 1 - alpha, in which an environment that the camera sees is opaque.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ls {

// The slices of a deep image: how many there are in a pixel (0: there is no deep image), and whether they
// have colours or only alpha.
struct DeepSlices {
  std::uint32_t count = 0;
  bool colours = true;  // true if there are no slices
  bool operator==(const DeepSlices&) const = default;
};
inline constexpr std::uint32_t kMostDeepSlices = 64;

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

}  // namespace ls
