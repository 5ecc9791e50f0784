#include "core/scene/analysis/prune.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "core/scene/analysis/unreachable.h"
#include "core/scene/limits.h"
#include "core/scene/motion.h"
#include "core/scene/schema/integrators.h"
#include "core/scene/schema/light_links.h"
#include "core/scene/schema/traits.h"
#include "core/scene/schema/validate.h"

namespace ls::scene {
namespace {

// True if the camera does not see the emitter, and nothing receives its light.
bool shines_on_nothing(const Emitter& emitter) {
  return std::visit(
      [](const auto& e) {
        if constexpr (requires { e.visible_camera; })
          if (e.visible_camera) return false;
        return !e.visible_reflection && !e.visible_volume;
      },
      emitter);
}

// True if no ray meets the shape.
bool is_hidden(const Shape& s) {
  return !s.visible_camera && !s.holdout && !s.visible_shadow && !s.visible_reflection && !s.visible_volume;
}

class Pruner {
 public:
  Pruner(const Scene& scene, const PrunedFor& whom)
      : assets_(scene.assets), s_(compacted(scene)), whom_(whom) {}

  Pruned run() {
    materials();
    lights();
    media();
    phases();
    invisible();
    if (s_.sensor.aperture_scale && !(s_.sensor.aperture_radius > 0)) {
      s_.sensor.aperture_scale.reset();
      note("shape of the lens", "the camera is a pinhole");
    }
    Pruned out{compacted(s_), {}};
    out.scene.sensor.shutter_close = moves(out.scene) ? 1 : 0;
    note("light linking", "its list has all that there is", drop_idle_links(out.scene));
    files(out.scene.assets);
    out.left_out = std::move(left_out_);
    return out;
  }

 private:
  void note(std::string what, std::string why, std::uint32_t count = 1, std::uint64_t bytes = 0) {
    if (count > 0) left_out_.push_back({std::move(what), std::move(why), count, bytes});
  }
  // Returns the value of a constant texture; nullptr for other textures.
  const Rgb* constant(TextureIndex t) const {
    const auto* c = std::get_if<ConstantTexture>(&s_.textures[t.value]);
    return c ? &c->value : nullptr;
  }
  bool everywhere(TextureIndex t, double value) const {
    const Rgb* c = constant(t);
    return c && *c == Rgb{value, value, value};
  }
  bool black(TextureIndex t) const { return everywhere(t, 0); }

  void media();
  std::vector<bool> named_media() const;
  void drop_dark_sources();
  std::uint32_t drop_idle_media();
  std::uint32_t drop_unreachable_media();
  void phases();
  void materials();
  bool simplify(Bsdf& b);
  void lights();
  void invisible();
  void files(const std::vector<Asset>& after);

  const std::vector<Asset> assets_;  // the files of the scene before pruning
  Scene s_;
  const PrunedFor whom_;
  std::vector<LeftOut> left_out_;
  std::uint32_t blends_ = 0, masks_ = 0;
};

// Removes the emission of media whose emission_scale is 0, so that the grids of the emission are not needed.
void Pruner::drop_dark_sources() {
  std::uint32_t dark = 0;
  for (Medium& medium : s_.media) {
    auto* m = std::get_if<HeterogeneousMedium>(&medium);
    if (!m || !(m->emission || m->source_radiance || m->temperature) || m->emission_scale != 0) continue;
    m->emission = m->source_radiance = m->temperature = m->emission_weight = std::nullopt;
    ++dark;
  }
  note("light given off by a medium", "its strength is 0", dark);
}

std::vector<bool> Pruner::named_media() const {
  std::vector<bool> named(s_.media.size(), false);
  const auto name = [&](const std::optional<MediumIndex>& m) {
    if (m) named[m->value] = true;
  };
  name(s_.sensor.medium);
  for (const Meter& m : s_.meters) name(m.medium);
  for (const Shape& s : s_.shapes) name(s.interior), name(s.exterior);
  return named;
}

// Removes media without effect, which neither absorb nor scatter nor emit. Where media overlap, the one of
// the highest priority displaces the others. So a medium without effect is kept if its priority is above that
// of some medium with an effect.
std::uint32_t Pruner::drop_idle_media() {
  const std::vector<bool> named = named_media();
  const auto idle = [&](const Medium& m) {
    const MediumTraits traits = traits_of(m, s_.volumes);
    return !whom_.media || !(traits.extinguishes || traits.emits);
  };
  const auto priority = [](const Medium& m) {
    return std::visit([](const auto& x) { return x.priority; }, m);
  };
  int lowest = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < named.size(); ++i)
    if (named[i] && !idle(s_.media[i])) lowest = std::min(lowest, priority(s_.media[i]));
  std::vector<bool> dead(named.size(), false);
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < named.size(); ++i) {
    dead[i] = named[i] && idle(s_.media[i]) && priority(s_.media[i]) <= lowest;
    count += dead[i];
  }
  const auto drop = [&](std::optional<MediumIndex>& m) {
    if (m && dead[m->value]) m.reset();
  };
  drop(s_.sensor.medium);
  for (Meter& m : s_.meters) drop(m.medium);
  for (Shape& s : s_.shapes) drop(s.interior), drop(s.exterior);
  return count;
}

// Removes media whose volumes no light enters.
std::uint32_t Pruner::drop_unreachable_media() {
  const std::vector<bool> out_of_reach = unreachable_interiors(s_);
  std::vector<std::optional<MediumIndex>> set_aside(s_.shapes.size());
  for (std::size_t i = 0; i < s_.shapes.size(); ++i)
    if (out_of_reach[i]) set_aside[i] = std::exchange(s_.shapes[i].interior, std::nullopt);
  const std::vector<bool> named = named_media();
  std::vector<bool> dropped(named.size(), false);
  for (std::size_t i = 0; i < set_aside.size(); ++i) {
    if (!set_aside[i]) continue;
    if (named[set_aside[i]->value])
      s_.shapes[i].interior = set_aside[i];
    else
      dropped[set_aside[i]->value] = true;
  }
  return static_cast<std::uint32_t>(std::count(dropped.begin(), dropped.end(), true));
}

// Removes media. It repeats until nothing changes, because a removed medium may have been the reason to keep
// another one.
void Pruner::media() {
  drop_dark_sources();
  std::uint32_t dead = 0, hidden = 0;
  for (bool more = true; more;) {
    const std::uint32_t idle = drop_idle_media(), unreachable = drop_unreachable_media();
    dead += idle;
    hidden += unreachable;
    more = idle + unreachable > 0;
  }
  // If no media are left, no surface is a boundary of a medium.
  const std::vector<bool> named = named_media();
  if (std::none_of(named.begin(), named.end(), [](bool n) { return n; }))
    for (Shape& s : s_.shapes) s.is_medium_transition = false;
  note("medium", whom_.media ? "it neither takes light nor gives any" : "the integrator sees none", dead);
  note("medium", "no light gets into what it fills", hidden);
}

void Pruner::phases() {
  std::uint32_t unasked = 0;
  const std::vector<bool> named = named_media();
  const PhaseIndex isotropic{static_cast<std::uint32_t>(s_.phases.size())};
  for (std::size_t i = 0; i < named.size(); ++i)
    std::visit(
        [&](auto& m) {
          if (!named[i] || traits_of(s_.media[i], s_.volumes).scatters ||
              std::holds_alternative<IsotropicPhase>(s_.phases[m.phase.value]))
            return;
          m.phase = isotropic;
          ++unasked;
        },
        s_.media[i]);
  if (unasked > 0) s_.phases.emplace_back(IsotropicPhase{});
  note("phase function", "its medium scatters no light", unasked);
}

// Simplifies a blend whose weight is 0 or 1 everywhere, or a mask whose opacity is 0 or 1 everywhere:
// replaces it by its only part that has an effect. This part may again be a blend or a mask. Returns false
// for all other bsdfs, which it leaves unchanged.
bool Pruner::simplify(Bsdf& b) {
  if (const auto* blend = std::get_if<BlendBsdf>(&b)) {
    const bool first = everywhere(blend->weight, 0);
    if (!first && !everywhere(blend->weight, 1)) return false;
    ++blends_;
    b = Bsdf(s_.bsdfs[(first ? blend->first : blend->second).value]);
    return true;
  }
  if (const auto* mask = std::get_if<MaskBsdf>(&b)) {
    const bool clear = everywhere(mask->opacity, 0);
    if (!clear && !everywhere(mask->opacity, 1)) return false;
    ++masks_;
    b = clear ? Bsdf(NullBsdf{}) : s_.bsdfs[mask->bsdf.value];
    return true;
  }
  return false;
}

// Simplifies each bsdf as far as possible. Each step removes one level of nesting, so kMaxBsdfNesting steps
// are enough.
void Pruner::materials() {
  for (Bsdf& b : s_.bsdfs)
    for (int step = 0; step < kMaxBsdfNesting && simplify(b); ++step) {
    }
  // After a blend was replaced by one of its parts, the front or the back of a two-sided material may itself
  // be two-sided. Such an inner material always shows its front, so it is replaced by its front.
  for (Bsdf& b : s_.bsdfs)
    if (auto* two = std::get_if<TwoSidedBsdf>(&b))
      for (BsdfIndex* side : {&two->front, &two->back})
        for (int step = 0; step < kMaxBsdfNesting; ++step)
          if (const auto* inner = std::get_if<TwoSidedBsdf>(&s_.bsdfs[side->value])) *side = inner->front;
  note("branch of a blend", "its weight is 0", blends_);
  note("mask", "its opacity is 0 or 1 everywhere", masks_);
}

void Pruner::lights() {
  std::uint32_t dark = 0;
  for (Shape& s : s_.shapes) {
    if (!s.emitter || !black(s.emitter->radiance)) continue;
    s.emitter.reset();
    ++dark;
  }
  dark += static_cast<std::uint32_t>(
      std::erase_if(s_.emitters, [&](const Emitter& e) { return traits_of(e, s_.textures).dark; }));
  note("light", "it is black", dark);
  note("light", "it is hidden from the camera, surfaces and media",
       static_cast<std::uint32_t>(std::erase_if(s_.emitters, shines_on_nothing)));
}

// Erases the elements for which `gone` returns true, and their labels (`labels` is empty or has one label per
// element). Returns the number of erased elements.
template <class T, class Gone>
std::uint32_t erase_labelled(std::vector<T>& all, std::vector<Label>& labels, const Gone& gone) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (gone(all[i])) continue;
    if (kept != i) {
      all[kept] = std::move(all[i]);
      if (!labels.empty()) labels[kept] = std::move(labels[i]);
    }
    ++kept;
  }
  const auto erased = static_cast<std::uint32_t>(all.size() - kept);
  all.resize(kept);
  if (!labels.empty()) labels.resize(kept);
  return erased;
}

// Removes surfaces that bound no medium and that light passes unchanged (bsdf "null") without being emitted
// there, or that no ray meets. Then removes the instances of groups that have no shapes left.
void Pruner::invisible() {
  const auto unseen = [&](const Shape& s) {
    return !whom_.passing_counts && std::holds_alternative<NullBsdf>(s_.bsdfs[s.bsdf.value]) &&
           !s.is_medium_transition && !s.emitter && !s.meter;
  };
  note("surface", "light passes it unchanged, and there is no medium on either side",
       erase_labelled(s_.shapes, s_.shape_labels, unseen));
  const auto hidden = [&](const Shape& s) { return is_hidden(s) && !s.is_medium_transition && !s.meter; };
  note("shape", "it is hidden from all rays", erase_labelled(s_.shapes, s_.shape_labels, hidden));
  std::vector<bool> seen(s_.groups.size(), false);
  for (const Shape& s : s_.shapes)
    if (s.group) seen[s.group->value] = true;
  note("instance", "nothing of its group can be seen",
       erase_labelled(s_.instances, s_.instance_labels,
                      [&](const Instance& i) { return !seen[i.group.value]; }));
}

void Pruner::files(const std::vector<Asset>& after) {
  for (const Asset& a : assets_)
    if (std::none_of(after.begin(), after.end(), [&](const Asset& b) { return a.digest == b.digest; }))
      note(a.name, "nothing that is needed names it", 1, a.bytes);
}

}  // namespace

PrunedFor pruned_for(std::string_view integrator, int max_depth) {
  const bool media = sees_media(integrator);
  return {media, !media && max_depth >= 0};
}

Pruned pruned(const Scene& scene, const PrunedFor& whom) { return Pruner(scene, whom).run(); }

}  // namespace ls::scene
