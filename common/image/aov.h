// The further outputs of an image (AOVs): their names, what a partial carries of each, how much that is. What
// each of them means is in docs/reference/aovs.md.
//
// A partial has, after its six planes of colour, first the planes of sums of those that are asked for, then
// those of identifiers (id_slots.h); within each kind they are sorted by name, which is the file's order,
// too.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"

namespace ls {

enum class Aov : std::uint8_t {
  albedo,
  coverage,
  depth,
  direct,
  emission,
  geo_normal,
  indirect,
  material_id,
  multiple,
  normal,
  position,
  shape_id,
  single,
  surface,
  uv,
  volume
};
inline constexpr std::size_t kAovs = 16;

// What its values are, and what they are divided by.
enum class AovKind {
  of_hits,  // sums over the samples that meet a surface; the mean is over these
  of_all,   // likewise, but the mean is over all samples: 0 where nothing is met
  light,    // parts of the radiance; the mean is over all samples
  ids       // identifiers, each with the number of its samples
};

struct AovRow {
  Aov aov;
  std::string_view name;  // as it is asked for, and the layer's
  AovKind kind;
  std::string_view components;  // of the layer: one letter a channel
  bool half;                    // a layer of half floats, unless the image is of floats
};
std::span<const AovRow> aov_rows();  // sorted by name
const AovRow& row_of(Aov aov);

class AovSet {
 public:
  constexpr AovSet() = default;
  constexpr explicit AovSet(std::uint32_t bits) : bits_(bits & ((1u << kAovs) - 1)) {}
  constexpr bool has(Aov a) const { return bits_ >> static_cast<int>(a) & 1; }
  constexpr bool any_of(AovSet other) const { return bits_ & other.bits_; }
  constexpr bool empty() const { return bits_ == 0; }
  constexpr std::uint32_t bits() const { return bits_; }
  constexpr AovSet with(Aov a) const { return AovSet(bits_ | 1u << static_cast<int>(a)); }
  bool operator==(const AovSet&) const = default;

 private:
  std::uint32_t bits_ = 0;
};
AovSet aovs_of(AovKind kind);  // all of a kind

// Names as people write them ("normal", "sh_normal", "crypto_object"; upper case and '-' are forgiven). What
// every image has anyway, "spp" and "stderr", is taken and adds nothing. invalid_argument: an unknown name;
// the message lists the known ones.
Result<AovSet> parse_aovs(std::span<const std::string> names);
std::vector<std::string> names_of(AovSet set);  // sorted
std::string known_aovs();                       // "albedo, coverage, ..."

// One plane of sums: a component of an AOV, or the number of samples that met a surface.
struct AovPlane {
  std::string name;      // the partial's channel: "aov.albedo.B", "aov.hits"
  Aov aov = Aov::depth;  // meaningless for the hits
  int component = 0;     // in the row's order
  bool hits = false;
};
struct AovPlanes {
  std::vector<AovPlane> sums;
  std::vector<Aov> ids;            // each has kIdPlanes planes
  std::vector<std::string> names;  // of all planes, in the order of a partial
  std::size_t count() const { return names.size(); }
  std::size_t hits = SIZE_MAX;  // index in sums of the plane of hits, if there is one
};
AovPlanes planes_of(AovSet set);

// Of a pixel: in a partial (and a tail), and in the film's sums.
std::size_t partial_bytes_per_pixel(AovSet set);
std::size_t film_bytes_per_pixel(AovSet set);

}  // namespace ls
