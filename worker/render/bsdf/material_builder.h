// The tools that the make_material() functions use to turn the description of a material in a scene into a
// kind for the inner loop.
#pragma once

#include <fmt/format.h>

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "core/scene/schema/traits.h"
#include "worker/render/bsdf/lobes.h"
#include "worker/render/bsdf/microfacet_tables.h"

namespace ls::render {

inline constexpr float kMinPrincipled = .001f;  // the smallest alpha of the facets of Burley's material

// Builds the parts of materials. After an error the functions still return something, so make_material()
// needs no error handling of its own: the builder records the first error and ignores later ones.
class MaterialBuilder {
 public:
  MaterialBuilder(const Scene& scene, const TextureTable& textures,
                  const std::vector<scene::BsdfTraits>& traits)
      : scene_(scene), textures_(textures), traits_(traits) {}

  void refuse(std::string text);
  bool refused() const { return error_.has_value(); }
  const std::optional<Error>& error() const { return error_; }

  Slot slot(TextureIndex t);
  // Clamps constant values to [0, 1], so that surfaces conserve energy, and counts the clamped slots.
  Slot reflectance(TextureIndex t);
  Roughness roughness(Microfacet distribution, TextureIndex u, TextureIndex v);
  Roughness roughness(Microfacet distribution, double alpha);
  // Returns the ratio of two indices of refraction, `inside` over `outside`.
  double index(double inside, double outside);
  float mean(const Slot& s) const;
  // Returns the material for one side of a two-sided material, where b is the material of that side. If b is
  // itself two-sided, its front is used for both sides.
  BsdfIndex side(BsdfIndex b);
  bool passes(BsdfIndex b) const { return traits_[b.value].passes; }

  // The tables of rough materials take about 30 to 50 ms each to compute, and many objects of a scene often
  // have the same roughness, so materials with equal parameters share one table. A scene that needs more than
  // kMostTables of them is refused: a small hostile file could keep a worker busy for hours.
  static constexpr std::size_t kMostTables = 2048;

  // Returns the transmittance table of a rough plastic's coat (microfacet_tables.h).
  const RoughPlasticTable& coat(Microfacet type, double alpha, double eta);
  // energy() returns the tables that compensate for light lost between the microfacets of a surface of the
  // kind `of` (microfacet_tables.h); null: the scene is refused.
  enum class EnergyOf { conductor, dielectric, coat };
  const MicrofacetEnergy* energy(EnergyOf of, const Roughness& roughness, double eta);
  const MicrofacetEnergy* energy(EnergyOf of, Microfacet type, double alpha, double eta,
                                 Accuracy accuracy = Accuracy::full);
  // Returns the energies of GGX facets whose alpha is the square of `roughness`, but at least kMinPrincipled.
  EnergyByRoughness energies(EnergyOf of, const Slot& roughness, double eta);

  // Returns the tables of a coated metal. Materials with equal `parameters` share them; `make` computes them
  // if they do not exist yet.
  const CoatedConductorTables& coated_conductor(const std::array<float, 4>& parameters,
                                                const std::function<CoatedConductorTables()>& make);

  std::uint64_t clamped() const { return clamped_; }
  std::vector<std::unique_ptr<const MicrofacetEnergy>> take_energies() { return std::move(energies_); }

 private:
  // Returns true if the new table is within kMostTables; otherwise refuses the scene.
  bool room_for_table();

  const Scene& scene_;
  const TextureTable& textures_;
  const std::vector<scene::BsdfTraits>& traits_;
  std::optional<Error> error_;
  std::uint64_t clamped_ = 0;
  std::map<std::tuple<Microfacet, double, double>, RoughPlasticTable> coats_;
  std::map<std::tuple<EnergyOf, Microfacet, double, double, Accuracy>, const MicrofacetEnergy*>
      known_energies_;
  std::vector<std::unique_ptr<const MicrofacetEnergy>> energies_;
  std::map<std::array<float, 4>, CoatedConductorTables> coated_conductors_;
};

}  // namespace ls::render
