#include "core/scene/schema/validate.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <utility>
#include <variant>
#include <vector>

#include "core/image/frame/meter_blocks.h"
#include "core/scene/limits.h"
#include "core/scene/motion.h"
#include "core/scene/schema/describe_fields.h"
#include "core/scene/schema/light_links.h"
#include "core/scene/schema/phase_tables.h"
#include "core/scene/schema/traits.h"
#include "core/scene/schema/volume_rules.h"
#include "core/scene/transform.h"

namespace ls::scene {
namespace {

class ValueChecker {
 public:
  explicit ValueChecker(const Scene& s) : s_(s) {}

  std::string run() {
    check_list("textures", s_.textures);
    check_list("bsdfs", s_.bsdfs);
    check_list("volumes", s_.volumes);
    check_list("phases", s_.phases);
    check_list("media", s_.media);
    check_list("shapes", s_.shapes);
    check_list("emitters", s_.emitters);
    check_list("instances", s_.instances);
    check_list("meters", s_.meters);
    IndexWalker walker([&](const auto& i) { check("sensor", i); });
    walker.walk(s_.sensor);
    if (wrong_.empty()) check_bsdf_nesting();
    if (wrong_.empty()) check_texture_nesting();
    if (wrong_.empty()) check_volumes();
    if (wrong_.empty()) check_phases();
    if (wrong_.empty()) check_groups();
    if (wrong_.empty()) check_crop();
    if (wrong_.empty()) check_labels();
    if (wrong_.empty()) check_meters();
    if (wrong_.empty()) check_motions();
    if (wrong_.empty() && LinkLists(s_).too_many())
      wrong_ = fmt::format("scene: the lights have more than {} different lists of receivers and blockers",
                           kMostLinkLists);
    if (wrong_.empty() && std::int64_t{s_.film.size.width} * s_.film.size.height > kMaxFramePixels)
      wrong_ = fmt::format("scene.film has more than {} pixels", kMaxFramePixels);
    return wrong_;
  }

 private:
  template <class List>
  void check_list(std::string_view name, const List& list) {
    for (std::size_t i = 0; i < list.size() && wrong_.empty(); ++i) {
      IndexWalker walker([&](const auto& index) { check(fmt::format("{}[{}]", name, i), index); });
      walker.walk(list[i]);
    }
  }
  template <class Tag>
  void check(std::string_view where, const Index<Tag>& i) {
    if (wrong_.empty() && i.value >= pool(s_, i).size())
      wrong_ =
          fmt::format("scene.{} refers to object {} of a list of {}", where, i.value, pool(s_, i).size());
  }
  void check_bsdf_nesting() {
    const auto traits = bsdf_traits(s_);
    if (!traits) {
      wrong_ =
          fmt::format("scene.bsdfs (twosided, mask, ...) contain each other in a circle or more than {} deep",
                      kMaxBsdfNesting);
      return;
    }
    for (const Bsdf& b : s_.bsdfs) {
      const auto* two = std::get_if<TwoSidedBsdf>(&b);
      if (!two) continue;
      for (const BsdfIndex side : {two->front, two->back})
        if ((*traits)[side.value].transmits || (*traits)[side.value].two_sided)
          wrong_ = "scene.bsdfs: a twosided bsdf holds one that lets light through, or another twosided";
    }
  }
  // Each list is checked before what refers to it.
  void check_volumes() {
    if (nested_too_deep(s_.volumes)) {
      wrong_ =
          fmt::format("scene.volumes contain each other in a circle or more than {} deep", kMaxVolumeNesting);
      return;
    }
    const auto check_each = [&](std::string_view list, const auto& all, const auto& problem_of) {
      for (std::size_t i = 0; i < all.size() && wrong_.empty(); ++i)
        if (const ParameterProblem p = problem_of(all[i]); !p.what.empty())
          wrong_ = fmt::format("scene.{}[{}]: '{}' {}", list, i, p.parameter, p.what);
    };
    check_each("volumes", s_.volumes, [&](const Volume& v) { return volume_problem(s_.volumes, v); });
    check_each("phases", s_.phases, [&](const Phase& p) {
      const auto* blend = std::get_if<BlendPhase>(&p);
      return blend ? phase_problem(s_.volumes, *blend) : ParameterProblem{};
    });
    check_each("media", s_.media, [&](const Medium& m) {
      const auto* volumes = std::get_if<HeterogeneousMedium>(&m);
      return volumes ? medium_problem(s_.volumes, *volumes) : ParameterProblem{};
    });
  }
  void check_phases() {
    if (nested_too_deep(s_.phases))
      wrong_ =
          fmt::format("scene.phases contain each other in a circle or more than {} deep", kMaxPhaseNesting);
    for (std::size_t i = 0; i < s_.phases.size() && wrong_.empty(); ++i)
      if (const auto* table = std::get_if<TabulatedPhase>(&s_.phases[i]))
        if (const auto [list, what] = table_problem(*table); !what.empty())
          wrong_ = fmt::format("scene.phases[{}]: '{}' {}", i, list, what);
    for (const Phase& phase : s_.phases)
      if (const auto* blend = std::get_if<BlendPhase>(&phase); blend && wrong_.empty())
        if (const auto* weight = std::get_if<ConstVolume>(&s_.volumes[blend->weight.value]))
          if (!is_grey(weight->value) || !kUnit.contains(weight->value[0]))
            wrong_ = "scene.phases: the weight of a blend is not one number from 0 to 1";
  }
  // Checks that the shapes of each group are contiguous in the scene's list of shapes and do not emit, that
  // every group has a shape, and that in this list the groups follow each other in the order of their
  // indices.
  void check_groups() {
    std::size_t seen = 0;
    const std::optional<GroupIndex>* last = nullptr;
    for (const Shape& s : s_.shapes) {
      const bool same = last && s.group == *last;
      last = &s.group;
      if (!s.group) continue;
      if (s.emitter) wrong_ = "scene.shapes: a shape in a group emits light";
      if (!same && s.group->value != seen++) wrong_ = "scene.shapes: groups are mixed or out of their order";
    }
    if (wrong_.empty() && seen != s_.groups.size()) wrong_ = "scene.groups: a group has no shapes";
  }
  void check_labels() {
    const auto fits = [](const auto& labels, const auto& things) {
      return labels.empty() || labels.size() == things.size();
    };
    if (!fits(s_.shape_labels, s_.shapes)) wrong_ = "scene.shape_labels are not as many as the shapes";
    if (!fits(s_.instance_labels, s_.instances))
      wrong_ = "scene.instance_labels are not as many as the instances";
  }
  void check_crop() {
    const FilmSettings& f = s_.film;
    const auto outside = [](int offset, int width, int whole) {
      return width < 1 || offset > whole || width > whole - offset;
    };
    const bool none = f.crop_size == FrameSize{0, 0} && f.crop_offset == std::array<int, 2>{0, 0};
    if (!none && (outside(f.crop_offset[0], f.crop_size.width, f.size.width) ||
                  outside(f.crop_offset[1], f.crop_size.height, f.size.height)))
      wrong_ = "scene.film: the crop is not within the frame";
  }
  // Checks that each meter has points or exactly one shape, which is not in a group, and that the film is
  // that of the meters.
  void check_meters() {
    std::vector<int> shapes(s_.meters.size());
    for (const Shape& s : s_.shapes) {
      if (s.meter && s.group) wrong_ = "scene.shapes: a shape in a group has a meter";
      if (s.meter) ++shapes[s.meter->value];
    }
    for (std::size_t i = 0; i < s_.meters.size() && wrong_.empty(); ++i)
      if (const auto problem = problem_of(s_.meters[i], shapes[i]); !problem.empty())
        wrong_ = fmt::format("scene.meters[{}] {}", i, problem);
    if (!wrong_.empty()) return;
    const std::size_t count = meter_count(s_);
    if ((count > 0) != (s_.sensor.projection == Projection::meters))
      wrong_ = "scene.sensor is not that of meters, or there are none";
    else if (count > kMaxMeters)
      wrong_ = fmt::format("scene.meters measure {} numbers; at most {} are allowed", count, kMaxMeters);
    else if (count > 0 && s_.film != film_of_meters(count))
      wrong_ = "scene.film is not that of the scene's meters";
  }
  void check_motions() {
    if (s_.sensor.shutter_open != 0 || s_.sensor.shutter_close != (moves(s_) ? 1 : 0))
      wrong_ = "scene.sensor has a shutter that is not that of what moves";
    if (s_.sensor.projection == Projection::meters && moves(s_))
      wrong_ = "scene has meters and something that moves";
    check_motion("sensor", s_.sensor);
    for (std::size_t i = 0; i < s_.shapes.size() && wrong_.empty(); ++i) {
      const std::string where = fmt::format("shapes[{}]", i);
      check_motion(where, s_.shapes[i]);
      const std::string_view why = why_still(s_.shapes[i]);
      if (!s_.shapes[i].motion.empty() && !why.empty() && wrong_.empty())
        wrong_ = fmt::format("scene.{} moves, but {}", where, why);
      for (const MotionKey& key : s_.shapes[i].motion)
        if (s_.shapes[i].emitter && !is_similarity(key.to_world) && wrong_.empty())
          wrong_ = fmt::format("scene.{} emits light, and its motion stretches it", where);
    }
    for (std::size_t i = 0; i < s_.instances.size() && wrong_.empty(); ++i)
      check_motion(fmt::format("instances[{}]", i), s_.instances[i]);
  }
  // Checks that times ascend from 0 to 1, and that the object can move by its keys and to_world is among its
  // poses.
  template <class T>
  void check_motion(std::string_view where, const T& object) {
    const std::vector<MotionKey>& keys = object.motion;
    if (keys.empty() || !wrong_.empty()) return;
    if (keys.size() < 2 || keys.size() > kMaxMotionKeys || keys.front().time != 0 || keys.back().time != 1) {
      wrong_ = fmt::format("scene.{}.motion must have 2 to {} keys, the first at time 0 and the last at 1",
                           where, kMaxMotionKeys);
      return;
    }
    const auto fail = [&](std::size_t i, std::string_view what) {
      if (wrong_.empty()) wrong_ = fmt::format("scene.{}.motion[{}] {}", where, i, what);
    };
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (i > 0 && !(keys[i].time > keys[i - 1].time)) fail(i, "is not later than the one before");
      if (!can_move(keys[i].to_world)) fail(i, "shears, or can't be inverted");
      if ((determinant3(keys[i].to_world) < 0) != (determinant3(keys[0].to_world) < 0))
        fail(i, "mirrors unlike the first");
    }
    if (!wrong_.empty()) return;
    // Machines may round the pose between two keys otherwise.
    const Transform middle = Motion(keys).at(.5);
    for (std::size_t i = 0; i < 16; ++i)
      if (!(std::abs(object.to_world.m[i] - middle.m[i]) <= 1e-9 * (1 + std::abs(middle.m[i]))))
        wrong_ = fmt::format("scene.{}.to_world is not the pose in the middle of its motion", where);
  }
  static std::string problem_of(const Meter& m, int shapes) {
    const bool on_shape = m.points.empty();
    if (on_shape != (shapes == 1) || shapes > 1) return "has not either points or one shape";
    if (on_shape && m.kind != MeterKind::irradiance && m.kind != MeterKind::flux)
      return fmt::format("is a {} in a shape", name_of(m.kind));
    if (!on_shape && m.kind == MeterKind::flux) return "is a fluxmeter without a shape";
    for (const MeterPoint& p : m.points) {
      const auto& d = p.direction;
      const double length = std::hypot(d[0], d[1], d[2]);
      // 1e-9: the rounding of double when a direction is normalised, with a large margin
      const bool fits = m.kind == MeterKind::fluence ? length == 0 : std::abs(length - 1) < 1e-9;
      if (!fits) return "has a direction that is not of unit length";
    }
    return "";
  }
  // Computes the nesting depths of the textures by passes over the list, until a pass changes nothing. In a
  // scene that is allowed, this takes at most kMaxReferenceDepth + 1 passes.
  void check_texture_nesting() {
    std::vector<int> depth(s_.textures.size(), 0);
    for (int round = 0; round <= kMaxReferenceDepth; ++round) {
      bool changed = false;
      for (std::size_t i = 0; i < s_.textures.size(); ++i) {
        int d = 0;
        if (const auto* c = std::get_if<CheckerboardTexture>(&s_.textures[i]))
          d = 1 + std::max(depth[c->color0.value], depth[c->color1.value]);
        else if (const auto* p = std::get_if<PeakTexture>(&s_.textures[i]))
          d = 1 + depth[p->texture.value];
        else if (const auto* product = std::get_if<ProductTexture>(&s_.textures[i]))
          d = 1 + std::max(depth[product->first.value], depth[product->second.value]);
        changed |= std::exchange(depth[i], d) != d;
      }
      if (!changed) return;
    }
    wrong_ =
        fmt::format("scene.textures contain each other in a circle or more than {} deep", kMaxReferenceDepth);
  }

  const Scene& s_;
  std::string wrong_;
};

class Compactor {
 public:
  explicit Compactor(const Scene& from) : from_(from) {}

  Scene run() {
    std::vector<bool> placed(from_.groups.size(), false);
    for (const Instance& i : from_.instances) placed[i.group.value] = true;
    for (std::size_t i = 0; i < from_.shapes.size(); ++i) {
      const Shape& s = from_.shapes[i];
      if (s.group && !placed[s.group->value]) continue;
      to_.shapes.push_back(s);
      if (!from_.shape_labels.empty()) to_.shape_labels.push_back(from_.shape_labels[i]);
    }
    to_.instance_labels = from_.instance_labels;
    to_.aovs = from_.aovs;
    to_.emitters = from_.emitters;
    to_.sensor = from_.sensor;
    to_.film = from_.film;
    to_.integrator = from_.integrator;
    to_.sample_count = from_.sample_count;
    for (Shape& s : to_.shapes) move(s);
    for (Emitter& e : to_.emitters) move(e);
    to_.instances = from_.instances;
    for (Instance& i : to_.instances) move(i);
    move(to_.sensor);
    // Shapes do not refer to meters at points, which are kept in their order.
    for (std::size_t i = 0; i < from_.meters.size(); ++i)
      if (!from_.meters[i].points.empty()) moved(MeterIndex{static_cast<std::uint32_t>(i)});
    return std::move(to_);
  }

 private:
  // Replaces the indices in the object by those of the new scene. The recursion is at most kMaxReferenceDepth
  // deep, since the nesting of the scene's objects has been checked before.
  template <class T>
  void move(T& object) {
    IndexWalker walker([&](auto& i) { i = moved(i); });
    walker.walk(object);
  }
  template <class I>
  I moved(I old) {
    auto& known = std::get<std::map<I, I>>(moved_);
    if (const auto it = known.find(old); it != known.end()) return it->second;
    auto object = pool(from_, old)[old.value];
    move(object);  // adds the objects that this one refers to before this one
    auto& list = pool(to_, old);
    const I fresh{static_cast<std::uint32_t>(list.size())};
    list.push_back(std::move(object));
    known.emplace(old, fresh);
    return fresh;
  }

  const Scene& from_;
  Scene to_;
  std::tuple<std::map<AssetIndex, AssetIndex>, std::map<TextureIndex, TextureIndex>,
             std::map<BsdfIndex, BsdfIndex>, std::map<VolumeIndex, VolumeIndex>,
             std::map<PhaseIndex, PhaseIndex>, std::map<MediumIndex, MediumIndex>,
             std::map<GroupIndex, GroupIndex>, std::map<MeterIndex, MeterIndex>>
      moved_;
};

}  // namespace

std::size_t meter_count(const Scene& scene) {
  std::size_t count = 0;
  for (const Meter& m : scene.meters) count += m.count();
  return count;
}

FilmSettings film_of_meters(std::size_t count) {
  FilmSettings film;
  film.size = MeterBlocks(count).frame();
  film.filter = BoxFilter{};
  return film;
}

std::string find_inconsistency(const Scene& s) { return ValueChecker(s).run(); }

Scene compacted(const Scene& s) { return Compactor(s).run(); }

}  // namespace ls::scene
