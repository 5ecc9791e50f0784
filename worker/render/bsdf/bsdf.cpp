#include "worker/render/bsdf/bsdf.h"

#include "core/scene/limits.h"
#include "worker/render/base/work_counters.h"
#include "worker/render/bsdf/conductor.h"
#include "worker/render/bsdf/dielectric.h"
#include "worker/render/bsdf/diffuse.h"
#include "worker/render/bsdf/nested.h"
#include "worker/render/bsdf/plastic.h"
#include "worker/render/bsdf/principled.h"

namespace ls::render {

// A material in the form that the inner loop uses. It contains the struct of its kind; each list of kinds
// below is a family of related kinds.
struct BsdfTable::Material {
  VariantOf<DiffuseKinds, ConductorKinds, DielectricKinds, PlasticKinds, NestedKinds, PrincipledKinds,
            CoatedConductorKinds>
      kind;
};

BsdfTable::BsdfTable() = default;
BsdfTable::~BsdfTable() = default;
BsdfTable::BsdfTable(BsdfTable&&) noexcept = default;
BsdfTable& BsdfTable::operator=(BsdfTable&&) noexcept = default;

namespace {

using Material = BsdfTable::Material;

V3 flipped(const V3& w) { return {w.x, w.y, -w.z}; }

template <class Kind>
Material material_of(Kind kind) {
  return {std::move(kind)};
}
template <class... Kind>
Material material_of(std::variant<Kind...> kind) {
  return std::visit([](auto& k) { return Material{std::move(k)}; }, kind);
}

// True if `holds(part)` is true for the index `part` of any material that m directly consists of.
template <class F>
bool any_part(const Material& m, F holds) {
  return with_kind(m.kind, [&](const auto& k) {
    for (const BsdfIndex part : k.parts())
      if (holds(part)) return true;
    return false;
  });
}

}  // namespace

Result<BsdfTable> BsdfTable::build(const Scene& scene, const TextureTable& textures) {
  BsdfTable table;
  table.textures_ = &textures;
  const auto traits = scene::bsdf_traits(scene);
  if (!traits)
    return fail(
        Errc::invalid_argument,
        fmt::format("a material contains one that does not exist, or itself, or materials nested more "
                    "than {} deep",
                    scene::kMaxBsdfNesting));
  MaterialBuilder builder(scene, textures, *traits);
  table.materials_.reserve(scene.bsdfs.size());
  for (const Bsdf& b : scene.bsdfs) {
    const std::size_t i = table.materials_.size();
    Material m = std::visit([&](const auto& one) { return material_of(make_material(one, builder)); }, b);
    if (builder.refused())
      return fail(builder.error()->code, fmt::format("material {}: {}", i, builder.error()->message));
    table.materials_.push_back(std::move(m));
  }
  table.clamped_ = builder.clamped();
  table.energies_ = builder.take_energies();
  return table;
}

// Diffuse with one reflectance everywhere, the most common material, is evaluated here directly, without the
// overhead of the general case.
BsdfEval BsdfTable::eval(BsdfIndex i, const UvPoint& uv, const V3& wo, const V3& wi) const {
  const Material* m = &materials_[i.value];
  V3 o = wo, in = wi;
  if (const auto* sides = std::get_if<TwoSided>(&m->kind)) {
    m = &materials_[(o.z < 0 ? sides->back : sides->front).value];
    if (o.z < 0) o = flipped(o), in = flipped(in);
  }
  if (const auto* diffuse = std::get_if<Diffuse>(&m->kind))
    return o.z > 0 && in.z > 0 ? eval_diffuse(diffuse->reflectance, in) : BsdfEval{};
  return eval_other(*m, uv, o, in);
}

BsdfEval BsdfTable::eval_other(const Material& m, const UvPoint& uv, const V3& wo, const V3& wi) const {
  return with_kind(m.kind, [&](const auto& k) -> BsdfEval {
    if (k.kFrontOnly && (!(wo.z > 0) || !(wi.z > 0))) return {};
    return k.eval(Lookup{*this, *textures_, uv}, wo, wi);
  });
}

std::optional<BsdfSample> BsdfTable::sample(BsdfIndex i, const UvPoint& uv, const V3& wo, float u_lobe,
                                            V2 u) const {
  const Material* m = &materials_[i.value];
  V3 o = wo;
  const auto* sides = std::get_if<TwoSided>(&m->kind);
  const bool from_behind = sides && o.z < 0;
  if (sides) m = &materials_[(from_behind ? sides->back : sides->front).value];
  if (from_behind) o = flipped(o);
  std::optional<BsdfSample> s;
  if (const auto* diffuse = std::get_if<Diffuse>(&m->kind)) {
    if (o.z > 0) s = sample_diffuse(diffuse->reflectance, u);
  } else {
    s = sample_other(*m, uv, o, u_lobe, u);
  }
  if (s && from_behind) s->wi = flipped(s->wi);
  return s;
}

std::optional<BsdfSample> BsdfTable::sample_other(const Material& m, const UvPoint& uv, const V3& wo,
                                                  float u_lobe, V2 u) const {
  return with_kind(m.kind, [&](const auto& k) -> std::optional<BsdfSample> {
    if (k.kFrontOnly && !(wo.z > 0)) return std::nullopt;
    return k.sample(Lookup{*this, *textures_, uv}, wo, u_lobe, u);
  });
}

NullTransmission BsdfTable::null_transmission(BsdfIndex i, const UvPoint& uv, const V3& w) const {
  LS_COUNT(null_transmission);
  return with_kind(materials_[i.value].kind, [&](const auto& k) -> NullTransmission {
    return k.null_transmission(Lookup{*this, *textures_, uv}, w);
  });
}

std::size_t BsdfTable::size() const { return materials_.size(); }
std::uint64_t BsdfTable::bytes() const {
  std::uint64_t energies = 0;
  for (const auto& e : energies_) energies += e->bytes();
  return materials_.size() * sizeof(Material) + energies;
}
std::uint64_t BsdfTable::clamped_inputs() const { return clamped_; }

bool BsdfTable::is_null(BsdfIndex i) const {
  return std::holds_alternative<NullBoundary>(materials_[i.value].kind);
}
bool BsdfTable::has_smooth(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  return with_kind(m.kind, [](const auto& k) { return k.kSmooth; }) ||
         any_part(m, [&](BsdfIndex part) { return has_smooth(part); });
}
bool BsdfTable::is_diffuse(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  if (const auto* sides = std::get_if<TwoSided>(&m.kind))
    return is_diffuse(sides->front) && is_diffuse(sides->back);
  return with_kind(m.kind, [](const auto& k) { return k.kDiffuse; });
}
bool BsdfTable::reads_uv(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  return with_kind(m.kind, [](const auto& k) { return k.reads_uv(); }) ||
         any_part(m, [&](BsdfIndex part) { return reads_uv(part); });
}
bool BsdfTable::anisotropic(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  return with_kind(m.kind, [](const auto& k) { return k.anisotropic(); }) ||
         any_part(m, [&](BsdfIndex part) { return anisotropic(part); });
}
bool BsdfTable::reads_slopes(BsdfIndex i) const {
  const Material& m = materials_[i.value];
  return with_kind(m.kind, [](const auto& k) { return k.reads_slopes(); }) ||
         any_part(m, [&](BsdfIndex part) { return reads_slopes(part); });
}

}  // namespace ls::render
