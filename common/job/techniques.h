// Additional sampling techniques of the integrators. They sample light that is found too rarely by BSDFs and
// phase functions, or by next-event estimation at vertices. A job's techniques depend on its scene and files:
// each worker chooses them when it builds the world (the scene prepared for rendering), and reports them with
// its results. A parameter of the scene's integrator switches each technique off
// (docs/reference/scene-format.md, Integrators).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace ls {

enum class Technique : std::uint8_t {
  equiangular,      // points on segments of paths in media, sampled near lights that have a position
  exponential,      // points on segments of paths in media, sampled by transmittance
  camera_points,    // several points on the segments of camera rays in media
  lamp_directions,  // a share of the directions is sampled close to lights without extent
  lamp_flights,     // a share of the flights through media is sampled to end close to lights without extent
  light_vertices,   // connections to points that a directional emitter lights
  light_tree,       // one of many lights, chosen by a tree
  path_reuse,       // subpaths from the second vertex on that several pixels share
  shadow_roulette,  // Russian roulette for shadow rays through grids that could contribute little
  sky_samples,      // a second direction from the first surface, sampled towards a constant environment
  path_splitting,   // in scenes with grids: splitting and Russian roulette by possible contribution
  sky_portals,      // sampling of directions towards the sky through openings
  local_lights,     // one of few lights, chosen by probabilities learned for each place
};

struct TechniqueRow {
  Technique technique;
  std::string_view name;  // in reports
  std::string_view what;  // for people
};
std::span<const TechniqueRow> techniques();  // all, in the order of the enumeration

// The parameter of the integrator, and its value, that switch a technique off.
struct TechniqueSwitch {
  std::string_view parameter, value;
};
TechniqueSwitch off_switch(Technique technique, std::string_view integrator);

class TechniqueSet {
 public:
  constexpr TechniqueSet() = default;
  // Unknown bits are dropped: they may come from a worker of another version.
  static TechniqueSet of_bits(std::uint32_t bits);
  void add(Technique t) { bits_ |= bit(t); }
  void add(TechniqueSet other) { bits_ |= other.bits_; }
  bool has(Technique t) const { return (bits_ & bit(t)) != 0; }
  std::uint32_t bits() const { return bits_; }
  bool operator==(const TechniqueSet&) const = default;

 private:
  static constexpr std::uint32_t bit(Technique t) { return 1u << static_cast<unsigned>(t); }
  std::uint32_t bits_ = 0;
};

// Returns a JSON list of the techniques of the set, each {name, what, off: {parameter, value}}.
std::string techniques_json(TechniqueSet set, std::string_view integrator);

}  // namespace ls
