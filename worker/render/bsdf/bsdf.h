// Surface scattering by index: one flat table, a switch on a kind tag, textures read only where they are not
// constant. Values are Mitsuba 3's (separable Smith masking, its Beckmann rational fit, its rough plastic
// tables).
//
// Some surfaces let a share of the light pass straight on (mask, thin dielectric): the veil. Paths and shadow
// rays go through it without a vertex, so that next-event estimation reaches lights behind; eval() and
// sample() are about the rest of the light, whose weights keep their share of the whole.
//
// Local frame: z = shading normal, x and y = the tangents that anisotropy refers to. wo (towards the viewer
// or the previous vertex) and wi (where the path goes next, or the light) are unit vectors that point AWAY
// from the surface. All values are for radiance carried from wi to wo: refraction includes the factor 1 /
// eta^2.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/math.h"
#include "worker/render/texture/texture.h"
#include "worker/render/texture/uv_point.h"

namespace ls::render {

struct MicrofacetEnergy;

struct BsdfEval {
  C3 f_cos{0, 0, 0};  // f |cos wi| [1/sr]; delta lobes give 0
  float pdf = 0;      // of sample() choosing wi by a smooth lobe [1/sr]; positive wherever f_cos is
};

struct BsdfSample {
  V3 wi{0, 0, 1};
  C3 weight{0, 0, 0};  // f |cos wi| / pdf, lobe choice included; for delta lobes the factor itself
  float pdf = 0;       // [1/sr], equal to eval(wi).pdf; for delta lobes the probability of the lobe
  bool delta = false;
  bool transmitted = false;  // wi is on the other side of the surface than wo
  float eta = 1;  // refractive index on the side of wi over that on the side of wo; 1 unless refracted
};

struct Veil {
  C3 transmission{0, 0, 0};  // the share of light that passes straight on
  float probability = 0;     // that a path should; 1 - probability is positive wherever anything else happens
};

class BsdfTable {
 public:
  BsdfTable();
  ~BsdfTable();
  BsdfTable(BsdfTable&&) noexcept;
  BsdfTable& operator=(BsdfTable&&) noexcept;

  // `textures` must outlive the table. invalid_argument: an index out of range, materials that contain
  // themselves, a two-sided one whose side lets light through, an index of refraction or roughness that is
  // not a positive finite number.
  static Result<BsdfTable> build(const Scene& scene, const TextureTable& textures);

  BsdfEval eval(BsdfIndex i, const UvPoint& uv, const V3& wo, const V3& wi) const;
  // Nothing: absorbed, or the sampled direction is on the wrong side. u_lobe and u are in [0, 1).
  std::optional<BsdfSample> sample(BsdfIndex i, const UvPoint& uv, const V3& wo, float u_lobe, V2 u) const;

  // For light along w, from either side.
  Veil veil(BsdfIndex i, const UvPoint& uv, const V3& w) const;

  bool is_null(BsdfIndex i) const;       // index-matched boundary: light passes unchanged
  bool has_veil(BsdfIndex i) const;      // some light passes straight on, some does not
  bool has_smooth(BsdfIndex i) const;    // any lobe that is not a delta: next-event estimation makes sense
  bool reads_uv(BsdfIndex i) const;      // some value of it is a texture
  bool anisotropic(BsdfIndex i) const;   // the tangents of the local frame matter
  bool reads_slopes(BsdfIndex i) const;  // dp/du and dp/dv matter (UvPoint)
  std::size_t size() const;
  std::uint64_t bytes() const;
  std::uint64_t clamped_inputs() const;  // reflectances above 1 or below 0 brought into [0, 1]

  struct Material;
  struct Principled;

 private:
  // One-sided kinds that are more than diffuse and of one reflectance.
  BsdfEval eval_lobes(const Material& m, const UvPoint& uv, const V3& wo, const V3& wi) const;
  std::optional<BsdfSample> sample_lobes(const Material& m, const UvPoint& uv, const V3& wo, float u_lobe,
                                         V2 u) const;
  BsdfEval eval_wide(const Material& m, const UvPoint& uv, const V3& wo, const V3& wi) const;
  std::optional<BsdfSample> sample_wide(const Material& m, const UvPoint& uv, const V3& wo, float u_lobe,
                                        V2 u) const;
  std::optional<BsdfSample> sample_part(std::uint32_t part, const UvPoint& uv, const V3& wo, float u_lobe,
                                        V2 u) const;
  struct Mixture;
  Mixture mixture(const Material& m, const UvPoint& uv, const V3& wo) const;

  std::vector<Material> materials_;
  std::vector<Principled> principled_;  // what those materials have beyond the others
  std::vector<std::unique_ptr<const MicrofacetEnergy>> energies_;  // of those with multiple_scattering
  const TextureTable* textures_ = nullptr;
  std::uint64_t clamped_ = 0;
};

}  // namespace ls::render
