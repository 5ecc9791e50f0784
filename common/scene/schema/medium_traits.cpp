#include "common/scene/schema/medium_traits.h"

namespace ls::scene {
namespace {

bool grey(const Rgb& c) { return c[0] == c[1] && c[1] == c[2]; }

struct TraitsOfMedium {
  const std::vector<Volume>& volumes;

  const ConstVolume* constant(VolumeIndex v) const { return std::get_if<ConstVolume>(&volumes[v.value]); }
  bool zero(VolumeIndex v) const { return constant(v) && all_zero(constant(v)->value); }

  MediumTraits operator()(const HomogeneousMedium& m) const {
    Rgb sigma_t = m.sigma_t;
    for (double& x : sigma_t) x *= m.scale;
    MediumTraits t;
    t.extinguishes = !all_zero(sigma_t);
    t.scatters = t.extinguishes && !all_zero(m.albedo);
    t.emits = !all_zero(m.emission) || (t.extinguishes && !all_zero(m.source_radiance));
    t.chromatic = !grey(sigma_t);
    return t;
  }
  MediumTraits operator()(const HeterogeneousMedium& m) const {
    MediumTraits t;
    t.extinguishes = m.scale != 0 && !all_zero(m.tint) && !zero(m.sigma_t);
    t.scatters = t.extinguishes && !zero(m.albedo);
    t.emits =
        m.emission_scale != 0 &&
        ((m.emission && !zero(*m.emission)) ||
         (t.extinguishes && ((m.source_radiance && !zero(*m.source_radiance)) || m.temperature.has_value())));
    Rgb sigma_t = m.tint;
    if (const ConstVolume* c = constant(m.sigma_t))
      for (std::size_t i = 0; i < 3; ++i) sigma_t[i] *= c->value[i];
    t.chromatic = !grey(sigma_t);
    t.grids = true;
    t.density_file = !constant(m.sigma_t);
    return t;
  }
};

}  // namespace

MediumTraits traits_of(const Medium& medium, const std::vector<Volume>& volumes) {
  return std::visit(TraitsOfMedium{volumes}, medium);
}

}  // namespace ls::scene
