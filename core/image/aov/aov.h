// Additional outputs of an image (AOVs): their names, sizes, and planes in a partial. A partial has the pixel
// sums of one tile over one range of samples; the film is the sum of all partials. docs/reference/aovs.md
// defines each AOV.
//
// After its six colour planes (A.R A.G A.B B.R B.G B.B: half A or B of the samples, then red, green or blue)
// a partial has the planes of sums of the requested AOVs, sorted by channel name, then the planes of
// identifiers (identifiers.h), sorted by the AOV's name. The partial's EXR file has these planes in the same
// order, except that it sorts the colour planes by name, too: A.B A.G A.R B.B B.G B.R.
//
// The slices of a deep image are further planes of sums, after those of the AOVs;
// core/image/aov/deep_planes.h says what they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/base/light/light_group.h"
#include "core/image/aov/deep_planes.h"

namespace ls {

// Number of colour planes of a partial, A.R A.G A.B B.R B.G B.B: sums over each half of the samples.
inline constexpr int kPartialChannels = 6;

enum class Aov : std::uint8_t {
  albedo,
  alpha,
  coverage,
  denoising_albedo,
  denoising_normal,
  depth,
  direct,
  emission,
  geo_normal,
  indirect,
  light_groups,
  material_id,
  multiple,
  normal,
  opacity,
  position,
  shadow_catcher,
  shape_id,
  single,
  surface,
  uv,
  volume,
  volume_light_groups,
  volume_opacity
};
inline constexpr std::size_t kAovs = 24;

// The type of an AOV's values, and by what number of samples its sums are divided.
enum class AovKind {
  of_hits,  // sums over the samples that hit a surface, divided by the number of these samples
  // sums over the samples that hit a surface, divided by the number of all samples: a miss counts as 0
  of_all,
  light,    // components of the radiance, divided by the number of all samples
  guide,    // for a denoiser: sums over all samples, separately for the two halves of the samples
  opacity,  // sums over all samples, separately for the two halves of the samples
  groups,   // like `opacity`, and separately for each light group
  ids       // identifiers, each with the number of samples that hit it
};
// True for an AOV whose R, G, B are those of a colour, as that of light or of a surface.
bool is_colour(Aov aov);
constexpr bool has_halves(AovKind kind) {
  return kind == AovKind::guide || kind == AovKind::opacity || kind == AovKind::groups;
}

struct AovRow {
  Aov aov;
  // name of the AOV in requests, and of its layer in the image (except for identifiers)
  std::string_view name;
  AovKind kind;
  std::string_view components;  // names of the layer's channels, one letter each
  bool half;                    // true: stored as half floats, unless float output is requested
};
std::span<const AovRow> aov_rows();  // all AOVs, sorted by name
const AovRow& row_of(Aov aov);

// A set of AOVs, the number of light groups for those of AovKind::groups, and the slices of a deep image.
class AovSet {
 public:
  constexpr AovSet() = default;
  constexpr explicit AovSet(std::uint32_t bits, std::size_t groups = 0, DeepSlices deep = {})
      : bits_(bits & ((1u << kAovs) - 1)), groups_(static_cast<std::uint32_t>(groups)), deep_(deep) {}
  constexpr bool has(Aov a) const { return bits_ >> static_cast<int>(a) & 1; }
  constexpr bool any_of(AovSet other) const { return bits_ & other.bits_; }
  constexpr bool empty() const { return bits_ == 0 && deep_.count == 0; }
  constexpr std::uint32_t bits() const { return bits_; }
  constexpr std::size_t groups() const { return groups_; }
  constexpr DeepSlices deep() const { return deep_; }
  constexpr AovSet with(Aov a) const { return AovSet(bits_ | 1u << static_cast<int>(a), groups_, deep_); }
  constexpr AovSet with_groups(std::size_t groups) const { return AovSet(bits_, groups, deep_); }
  constexpr AovSet with_deep(DeepSlices deep) const { return AovSet(bits_, groups_, deep); }
  bool operator==(const AovSet&) const = default;

 private:
  std::uint32_t bits_ = 0, groups_ = 0;
  DeepSlices deep_;
};
AovSet aovs_of(AovKind kind);  // returns all AOVs of a kind

// Parses names of AOVs. Common other names ("sh_normal", "crypto_object") are accepted; case is ignored, and
// '-' stands for '_'. "spp" and "stderr" are accepted and add nothing, since every image has these layers.
// invalid_argument: an unknown name; the message lists the known ones.
Result<AovSet> parse_aovs(std::span<const std::string> names);
std::vector<std::string> names_of(AovSet set);  // returns the names, sorted
std::string known_aovs();                       // returns "albedo, coverage, ..."

// One plane of sums: a component of an AOV, or the number of samples that hit a surface.
struct AovPlane {
  // name of its channel in the partial's file: "aov.albedo.B", "aov.denoising_albedo.A.B", "aov.hits",
  // "aov.light_groups.03.A.B"
  std::string name;
  Aov aov = Aov::depth;  // not used in the plane of hits
  int component = 0;     // index in AovRow::components
  // half of the samples, for AOVs with halves (has_halves()): 0 is A, 1 is B; for other AOVs 0, and the plane
  // is for all samples
  int half = 0;
  bool hits = false;
  std::size_t group = 0;  // index of the light group, for AovKind::groups
};
struct AovPlanes {
  std::vector<AovPlane> sums;  // those of AOVs
  // The planes of the slices of a deep image, which follow those of `sums`: their number, in the order of
  // DeepPlanes (deep_planes.h)
  std::size_t deep = 0;
  std::vector<Aov> ids;  // the AOVs of identifiers; each has kIdPlanes planes
  // names of all planes (sums, those of slices, then identifiers), in the order within a partial
  std::vector<std::string> names;
  std::size_t count() const { return names.size(); }
  std::size_t all_sums() const { return sums.size() + deep; }  // the planes of sums, with those of slices
  std::size_t hits = SIZE_MAX;  // index in `sums` of the plane of hits; SIZE_MAX: there is none
};
AovPlanes planes_of(AovSet set);

// Returns the bytes per pixel of a partial. If the last round of a tile is truncated, the film keeps the sums
// of this round separately, in the same form.
std::size_t partial_bytes_per_pixel(AovSet set);
// Returns the bytes per pixel of the sums that a film holds.
std::size_t film_bytes_per_pixel(AovSet set);

}  // namespace ls
