#include "worker/render/world/phase_build.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/scene/schema/phase_tables.h"
#include "worker/render/media/grid_load.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

// Makes one phase function of each kind.
struct PhaseMaker {
  using Made = Result<PhaseFunctions::Kind>;
  const Scene& scene;
  const AssetLoader& files;
  World& w;

  Made operator()(const IsotropicPhase&) const { return HenyeyGreensteinLobe{0}; }
  Made operator()(const HgPhase& p) const { return with_g(p.g, HenyeyGreensteinLobe{p.g}); }
  Made operator()(const RayleighPhase&) const { return RayleighLobe{}; }
  Made operator()(const DrainePhase& p) const { return with_g(p.g, DraineLobe{p.g, p.alpha}); }
  Made operator()(const DropletsPhase& p) const { return DropletLobe::of_diameter(p.diameter); }
  Made operator()(const FournierForandPhase& p) const { return FournierForandLobe(p.backscatter, p.ior); }
  Made operator()(const TabulatedPhase& p) const {
    const scene::PhaseValues table = scene::values_of(p);
    return TabulatedLobe(table.cosines, table.values);
  }
  Made operator()(const BlendPhase& p) const;

  // Rejects a g that rounds to 1 or -1 in float32, such as 0.99999999: directions in float32 can't tell so
  // narrow a peak from a delta.
  static Made with_g(double g, PhaseFunctions::Kind kind) {
    if (std::abs(static_cast<float>(g)) < 1) return kind;
    return fail(Errc::invalid_argument,
                fmt::format("a phase function's g = {} is, to the precision of the renderer, not between -1 "
                            "and 1; light scattered so far forward passes as if there were no medium",
                            g));
  }
};

PhaseMaker::Made PhaseMaker::operator()(const BlendPhase& p) const {
  BlendedLobes blend{.first = p.first.value, .second = p.second.value};
  const Volume& weight = scene.volumes.at(p.weight.value);
  if (const auto* c = std::get_if<ConstVolume>(&weight)) {
    blend.weight = static_cast<float>(c->value[0]);
    return blend;
  }
  // Bounds of computed values are a little above them; what is above 1 is taken as 1.
  constexpr float kMostBound = 1 + 1e-5f;
  constexpr double kToSigma = 1;  // without effect: no ray walks through the grid's cells
  auto loaded = load_volume(weight, files, w.geometry.center, w.geometry.scale, kToSigma);
  if (!loaded) return tl::unexpected(loaded.error());
  const Grid& grid = loaded->channels[0];
  std::string wrong;
  if (loaded->channels.size() != 1)
    wrong = fmt::format("has {} channels, not one", loaded->channels.size());
  else if (loaded->clamped > 0)
    wrong = fmt::format("has {} values below 0; its values are from 0 to 1", loaded->clamped);
  else if (grid.max_value() > (loaded->field ? kMostBound : 1))
    wrong = fmt::format("reaches {}; its values are from 0 to 1", grid.max_value());
  if (!wrong.empty()) {
    const auto* file = std::get_if<GridVolume>(&weight);
    return fail(Errc::invalid_argument, fmt::format("{}the weight of a blendphase {}",
                                                    file ? files.name(file->file) + ": " : "", wrong));
  }
  if (loaded->field) w.fields.push_back(std::move(loaded->field));
  blend.grid = &w.grids.emplace_back(std::move(loaded->channels[0]));
  return blend;
}

}  // namespace

Result<void> build_phases(const Scene& scene, const AssetLoader& files, World& w) {
  for (const Phase& phase : scene.phases) {
    auto made = std::visit(PhaseMaker{scene, files, w}, phase);
    if (!made) return tl::unexpected(made.error());
    w.phases.add(std::move(*made));
  }
  w.phases.find_mean_cosines();
  return {};
}

void set_phase(const Scene& scene, PhaseIndex i, const PhaseFunctions& all, Medium& m) {
  const Phase& phase = scene.phases.at(i.value);
  if (std::holds_alternative<IsotropicPhase>(phase)) return;
  if (const auto* hg = std::get_if<HgPhase>(&phase)) {
    m.phase.g = static_cast<float>(hg->g);
    return;
  }
  m.other_phases = &all;
  m.other_phase = i.value;
  constexpr double kSharpest = .9999;  // a rough idea is enough (Medium::phase)
  m.phase.g = static_cast<float>(std::clamp(all.mean_cosine(i.value), -kSharpest, kSharpest));
}

}  // namespace ls::render
