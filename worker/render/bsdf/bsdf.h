// The surface scattering functions (BSDFs) of a scene, in one flat table by index. Each kind of material is
// a struct in the file of its family (bsdf.cpp lists them). A texture is looked up only if it is not
// constant. The BSDF values are those of Mitsuba 3 (separable Smith masking, its Beckmann rational fit, its
// rough plastic tables).
//
// Some surfaces have null transmission (mask, thin dielectric): part of the light passes straight through.
// Paths and shadow rays pass such a surface without a vertex, so that next-event estimation reaches lights
// behind it. eval() and sample() cover only the remaining light. Their values are not renormalised: they are
// fractions of all incident light.
//
// Local frame: z = shading normal, x and y = the tangents that anisotropy refers to. wo (towards the viewer
// or the previous vertex) and wi (towards the next vertex or the light) are unit vectors that point AWAY from
// the surface. All values are for radiance carried from wi to wo: refraction includes the factor 1 / eta^2.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/scene/scene.h"
#include "worker/render/math/math.h"
#include "worker/render/texture/surface_attributes.h"
#include "worker/render/texture/texture.h"

namespace ls::render {

struct MicrofacetEnergy;

struct BsdfEval {
  C3 f_cos{0, 0, 0};  // f |cos wi| [1/sr], where f is the BSDF; 0 for delta lobes
  // The density [1/sr] with which sample() chooses wi by one of its smooth (not delta) lobes. It is positive
  // wherever f_cos is.
  float pdf = 0;
};

struct BsdfSample {
  V3 wi{0, 0, 1};
  // f |cos wi| / pdf, where pdf includes the probability of the lobe. For a delta lobe: its reflectance or
  // transmittance over its probability.
  C3 weight{0, 0, 0};
  float pdf = 0;  // [1/sr], equal to eval(wi).pdf; for delta lobes the probability of the lobe
  bool delta = false;
  bool transmitted = false;  // true if wi is on the other side of the surface than wo
  float eta = 1;  // refractive index on the side of wi over that on the side of wo; 1 unless refracted
};

struct NullTransmission {
  C3 transmission{0, 0, 0};  // share of light that passes straight through
  // The probability with which a path should pass straight through. It is below 1 wherever the surface also
  // scatters light, so that paths can do either.
  float probability = 0;
};

class BsdfTable {
 public:
  BsdfTable();
  ~BsdfTable();
  BsdfTable(BsdfTable&&) noexcept;
  BsdfTable& operator=(BsdfTable&&) noexcept;

  // Builds the table of the scene's materials. `textures` must outlive it. Fails with invalid_argument if an
  // index is out of range, if a material contains itself or is nested more than scene::kMaxBsdfNesting
  // levels deep, if one side of a two-sided material lets light through, or if a parameter, such as a
  // roughness, is out of its range.
  static Result<BsdfTable> build(const Scene& scene, const TextureTable& textures);

  BsdfEval eval(BsdfIndex i, const UvPoint& uv, const V3& wo, const V3& wi) const;
  // Samples wi for the given wo. u_lobe, in [0, 1), chooses the lobe and u, in [0, 1)^2, the direction within
  // the lobe. Returns nullopt if the light is absorbed, or if the sampled direction is on the wrong side of
  // the surface.
  std::optional<BsdfSample> sample(BsdfIndex i, const UvPoint& uv, const V3& wo, float u_lobe, V2 u) const;

  // Returns the null transmission at `uv` for light that travels along the direction w, which may cross the
  // surface from either side.
  NullTransmission null_transmission(BsdfIndex i, const UvPoint& uv, const V3& w) const;

  // True for an index-matched boundary: light passes unchanged
  bool is_null(BsdfIndex i) const;
  // True if the material has a lobe that is not a delta, so that next-event estimation is useful
  bool has_smooth(BsdfIndex i) const;
  // True if the material is ideally diffuse: f_cos and pdf are |cos wi| times factors that do not depend on
  // the directions, except on whether wo and wi are on the front or the back
  bool is_diffuse(BsdfIndex i) const;
  bool reads_uv(BsdfIndex i) const;      // true if some parameter is a texture
  bool anisotropic(BsdfIndex i) const;   // true if rotating the tangents changes the values
  bool reads_slopes(BsdfIndex i) const;  // true if it uses dp/du and dp/dv (see UvPoint)
  std::size_t size() const;
  std::uint64_t bytes() const;
  std::uint64_t clamped_inputs() const;  // number of reflectances clamped to [0, 1]

  struct Material;

 private:
  // eval() and sample() handle two-sided materials and diffuse materials with one reflectance everywhere; for
  // all other kinds they call the two functions below.
  BsdfEval eval_other(const Material& m, const UvPoint& uv, const V3& wo, const V3& wi) const;
  std::optional<BsdfSample> sample_other(const Material& m, const UvPoint& uv, const V3& wo, float u_lobe,
                                         V2 u) const;

  std::vector<Material> materials_;
  // Tables that compensate for energy lost between microfacets (microfacet_tables.h). Materials with the
  // parameter multiple_scattering contain pointers to them.
  std::vector<std::unique_ptr<const MicrofacetEnergy>> energies_;
  const TextureTable* textures_ = nullptr;
  std::uint64_t clamped_ = 0;
};

}  // namespace ls::render
