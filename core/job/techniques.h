// Additional sampling techniques of the integrators. They are for light that the basic techniques find too
// rarely: sampling of BSDFs and phase functions, and next-event estimation at path vertices. A job's
// techniques depend on its scene and files: each worker chooses them when it builds the world (the scene
// prepared for rendering), and reports them with its results. A parameter of the scene's integrator, or the
// job's setting `techniques`, switches each technique off (docs/reference/scene-format.md, Integrators).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/scene/scene.h"

namespace ls {

enum class Technique : std::uint8_t {
  equiangular,      // samples points on path segments in media, close to lights that have a position
  exponential,      // samples points on path segments in media in proportion to the transmittance
  camera_points,    // samples several points on the segments of camera rays in media
  lamp_directions,  // aims a share of all sampled directions close to a light without extent
  lamp_flights,     // lets a share of the free flights in media end close to lights without extent
  light_vertices,   // connects paths to points that are lit by a directional emitter
  light_tree,       // chooses one of many lights with a tree of lights
  path_reuse,       // lets several pixels share the part of a path from its second vertex on
  shadow_roulette,  // traces shadow rays through grids with Russian roulette if they can contribute little
  sky_samples,      // samples a second direction at the first surface, towards a constant environment
  path_splitting,   // in scenes with grids: splits or ends paths by what they can still contribute
  sky_portals,      // samples directions towards the sky through openings
  local_lights,     // chooses one of few lights by probabilities that are learned for each place
  emissive_grids,   // samples directions towards the cells of emissive grids
};

struct TechniqueRow {
  Technique technique;
  std::string_view name;  // name in reports
  std::string_view what;  // what the technique does, in words for users
};
std::span<const TechniqueRow> techniques();  // all, in the order of the enumeration

// A technique is switched off by setting the integrator's parameter `parameter` to `value`.
struct TechniqueSwitch {
  std::string_view parameter, value;
};
TechniqueSwitch off_switch(Technique technique, std::string_view integrator);

class TechniqueSet {
 public:
  constexpr TechniqueSet() = default;
  // Returns the techniques whose bits are set. Bits of unknown techniques, which a worker of another version
  // may send, are ignored.
  static TechniqueSet of_bits(std::uint32_t bits);
  void add(Technique t) { bits_ |= bit(t); }
  void add(TechniqueSet other) { bits_ |= other.bits_; }
  bool has(Technique t) const { return (bits_ & bit(t)) != 0; }
  std::uint32_t bits() const { return bits_; }
  bool empty() const { return bits_ == 0; }
  bool operator==(const TechniqueSet&) const = default;

 private:
  static constexpr std::uint32_t bit(Technique t) { return 1u << static_cast<unsigned>(t); }
  std::uint32_t bits_ = 0;
};

// Returns a JSON list of the techniques of the set, each {name, what, off: {parameter, value}}.
std::string techniques_json(TechniqueSet set, std::string_view integrator);

// The techniques that a job asks for, or excludes, instead of what its scene's integrator says. For
// debugging: every image is right with any of them.
struct TechniqueChoice {
  TechniqueSet with;     // used wherever the scene, its size or its samples permit it
  TechniqueSet without;  // not used
  bool operator==(const TechniqueChoice&) const = default;
};
// Returns the text "-path_reuse,+light_vertices": names in the order of the enumeration.
std::string to_string(const TechniqueChoice& choice);
// nullopt: a name is not known or not marked by + or -, a technique is named twice, or both `equiangular` and
// `exponential` are excluded, one of which is needed.
std::optional<TechniqueChoice> parse_technique_choice(std::string_view text);
std::string technique_names();  // all, separated by commas, for messages
// Returns the integrator's settings with the choice applied. Techniques that the integrator does not have
// change nothing.
IntegratorSettings with_choice(IntegratorSettings integrator, const TechniqueChoice& choice);

}  // namespace ls
