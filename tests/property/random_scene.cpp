#include "tests/property/random_scene.h"

#include <algorithm>
#include <iterator>

#include "core/scene/motion.h"
#include "core/scene/schema/validate.h"
#include "core/scene/transform.h"
#include "tests/property/draw.h"

namespace ls::test {
namespace {

class Composer {
 public:
  Composer(RandomScene& out, Dice& dice)
      : out_(out), scene_(out.scene), dice_(dice), draw_(dice, out.scene, out.assets, out.choice) {}

  void run() {
    if (dice_.chance(.35)) floor();
    if (dice_.chance(.2)) room();
    const std::size_t shapes = 1 + dice_.below(5);
    for (std::size_t i = 0; i < shapes; ++i) scene_.shapes.push_back(shape());
    if (dice_.chance(.3)) group();
    lights();
    camera();
    film();
    visibility();
    integrator();
    if (draw_.wild()) scene_.sample_count = static_cast<std::uint64_t>(dice_.extreme({1, 1e6}));
    links();
    motion();
    if (dice_.chance(.1)) shape_motion();
  }

 private:
  Shape shape() {
    Shape s;
    draw_.any(s.geometry);
    bool alike = false;
    if (auto* mesh = std::get_if<MeshShape>(&s.geometry)) mesh_file(*mesh);
    if (auto* ball = std::get_if<SphereShape>(&s.geometry)) {
      ball->radius = draw_.wild() ? dice_.extreme(scene::kPositive) : dice_.between(.3, 1);
      if (dice_.chance(.7)) ball->center = {};
      alike = true;
    }
    if (auto* c = std::get_if<CylinderShape>(&s.geometry)) {
      if (c->p0 == c->p1) c->p1 = {0, 0, 1};
      alike = true;
    }
    s.to_world = draw_.placement(.8, alike);
    s.flip_normals = dice_.chance(.1);
    // Media stand behind what lets rays in, as a rule.
    if (dice_.chance(.5)) {
      s.interior = some_medium();
      s.is_medium_transition = true;
      s.bsdf = dice_.chance(.7) ? SceneBuilder::push<BsdfTag>(scene_.bsdfs, NullBsdf{}) : draw_.bsdf();
    } else {
      s.bsdf = draw_.bsdf();
    }
    if (dice_.chance(.05)) {
      s.exterior = some_medium();
      s.is_medium_transition = true;
    }
    if (dice_.chance(.2)) emit(s);
    return s;
  }
  MediumIndex some_medium() {
    if (!scene_.media.empty() && dice_.chance(.4))
      return {static_cast<std::uint32_t>(dice_.below(scene_.media.size()))};
    return draw_.medium();
  }
  void emit(Shape& s) {
    AreaEmitter e;
    draw_.fill(e);
    if (dice_.chance(.6)) e.cutoff_angle = e.beam_width = 90, e.falloff = 1;
    e.beam_width = std::min(e.beam_width, e.cutoff_angle);
    if (e.beam_width == 90) e.falloff = 1;
    s.emitter = e;
  }
  void mesh_file(MeshShape& mesh) {
    const double wild = out_.choice.wild;
    const std::size_t kind = dice_.below(3);
    mesh.format = kind == 0 ? MeshFormat::obj : kind == 1 ? MeshFormat::ply : MeshFormat::serialized;
    mesh.shape_index = 0;
    // It is no parameter of `serialized`.
    if (mesh.format == MeshFormat::serialized) mesh.flip_tex_coords = false;
    mesh.file = SceneBuilder::push<AssetTag>(scene_.assets,
                                             kind == 0   ? random_obj(dice_, out_.assets, wild)
                                             : kind == 1 ? random_ply(dice_, out_.assets, wild)
                                                         : random_serialized(dice_, out_.assets, wild));
  }
  void floor() {
    Shape s;
    s.geometry = RectangleShape{};
    s.to_world = translate({0, 0, -1.5}) * scale(6);
    s.bsdf = draw_.bsdf();
    scene_.shapes.push_back(s);
  }
  void room() {  // seen from inside
    Shape s;
    s.geometry = CubeShape{};
    s.to_world = scale(8);
    s.flip_normals = true;
    s.bsdf = SceneBuilder::push<BsdfTag>(scene_.bsdfs, DiffuseBsdf{draw_.texture(scene::kUnit)});
    if (dice_.chance(.3)) {
      s.exterior = some_medium();
      s.is_medium_transition = true;
    }
    if (dice_.chance(.4)) emit(s);
    scene_.shapes.push_back(s);
  }
  void group() {
    const auto g = SceneBuilder::push<GroupTag>(scene_.groups, ShapeGroup{});
    const std::size_t shapes = 1 + dice_.below(2), instances = 1 + dice_.below(3);
    for (std::size_t i = 0; i < shapes; ++i) {
      Shape s = shape();
      s.emitter.reset();
      s.group = g;
      scene_.shapes.push_back(s);
    }
    for (std::size_t i = 0; i < instances; ++i)
      scene_.instances.push_back(Instance{g, draw_.placement(.6, dice_.chance(.6))});
  }
  void lights() {
    bool environment = false;
    const std::size_t n = dice_.below(4);
    for (std::size_t i = 0; i < n; ++i) {
      Emitter e;
      draw_.any(e);
      const bool around =
          std::holds_alternative<ConstantEmitter>(e) || std::holds_alternative<EnvmapEmitter>(e);
      if (around && std::exchange(environment, true)) continue;
      settle(e);
      scene_.emitters.push_back(e);
    }
  }
  void settle(Emitter& e) {
    const auto rigid = [&] { return draw_.placement(1, true); };
    if (auto* d = std::get_if<DirectionalEmitter>(&e)) {
      if (d->direction == Vec3{0, 0, 0}) d->direction = {0, 0, -1};
      if (dice_.chance(.5)) d->angular_radius = 0;
    } else if (auto* spot = std::get_if<SpotEmitter>(&e)) {
      spot->beam_width = std::min(spot->beam_width, spot->cutoff_angle);
      if (spot->texture && std::holds_alternative<ConstantTexture>(scene_.textures[spot->texture->value]))
        spot->texture.reset();
      aim(spot->to_world);
    } else if (auto* env = std::get_if<EnvmapEmitter>(&e)) {
      env->file = SceneBuilder::push<AssetTag>(
          scene_.assets, random_environment(dice_, out_.assets, out_.choice.wild, env->mapping));
      env->to_world = dice_.chance(.5) ? Transform{} : rigid();
    } else if (auto* p = std::get_if<ProjectorEmitter>(&e)) {
      aim(p->to_world);
    } else if (auto* g = std::get_if<GoniometricEmitter>(&e)) {
      aim(g->to_world);
    }
  }
  Vec3 around(double distance) {
    const Vec3 d = unit({dice_.gauss(), dice_.gauss(), dice_.gauss()});
    return {distance * d[0], distance * d[1], distance * d[2]};
  }
  void aim(Transform& t) {
    const Vec3 to{.5 * dice_.gauss(), .5 * dice_.gauss(), .5 * dice_.gauss()};
    t = look_at(around(dice_.between(2, 5)), to, unit({dice_.gauss(), dice_.gauss(), dice_.gauss()}));
  }
  void camera() {
    Sensor& s = scene_.sensor;
    Sensor drawn;
    draw_.fill(drawn);
    draw_sensor(drawn, s);
    aim(s.to_world);
    if (s.near_clip >= s.far_clip) s.far_clip = s.near_clip * 2;
    if (s.near_clip >= s.far_clip) s.near_clip = 1e-2, s.far_clip = 1e4;
    if (!dice_.chance(.1)) s.medium.reset();
  }
  // Some cameras move: from where they are to elsewhere, by way of a third pose.
  void motion() {
    if (!dice_.chance(.1)) return;
    Sensor& s = scene_.sensor;
    const double far = dice_.chance(.3) ? 2 : .1;
    Transform end = s.to_world, middle;
    end.m[3] += far * dice_.gauss();
    end.m[7] += far * dice_.gauss();
    aim(middle);
    if (dice_.chance(.7)) middle = end;
    s.motion = {{0, s.to_world}, {dice_.between(.1, .9), middle}, {1, end}};
    s.shutter_close = 1;
    s.to_world = scene::Motion(s.motion).at(.5);
  }
  // Some shapes and instances move: from where they are to elsewhere, and turn.
  void shape_motion() {
    for (Shape& s : scene_.shapes)
      if (!s.group && !s.meter) move(s, !s.emitter);
    for (Instance& i : scene_.instances) move(i, true);
  }
  template <class T>
  void move(T& object, bool may_stretch) {
    if (!dice_.chance(.5) || scene_.sensor.projection == Projection::meters) return;
    const Transform begin = object.to_world;
    if (!scene::can_move(begin) || !(may_stretch || scene::is_similarity(begin))) return;
    const double far = dice_.chance(.3) ? 2 : .1;
    const Vec3 way{far * dice_.gauss(), far * dice_.gauss(), far * dice_.gauss()};
    const Transform turn = dice_.chance(.5) ? rotate_x(dice_.between(-170, 170)) : Transform{};
    const Transform end = translate(way) * turn * begin * scale(dice_.chance(.3) ? 1.5 : 1);
    object.motion = {{0, begin}, {1, end}};
    object.to_world = scene::Motion(object.motion).at(.5);
    scene_.sensor.shutter_close = 1;
  }
  // What each kind of camera knows; the rest as it is when it is not given.
  void draw_sensor(const Sensor& drawn, Sensor& s) {
    const double kind = dice_.unit();
    s.projection = kind < .7    ? Projection::perspective
                   : kind < .85 ? Projection::orthographic
                                : Projection::spherical;
    s.medium = drawn.medium;
    const bool wild = draw_.wild();
    if (s.projection == Projection::spherical) return;
    if (wild) s.near_clip = drawn.near_clip, s.far_clip = drawn.far_clip;
    if (s.projection == Projection::orthographic) return;
    s.fov = out_.choice.wild > 0 && wild ? drawn.fov : dice_.between(15, 90);
    s.fov_axis = drawn.fov_axis;
    if (dice_.chance(.2)) s.principal_point_offset = {dice_.between(-.3, .3), dice_.between(-.3, .3)};
    if (wild) s.principal_point_offset = drawn.principal_point_offset;
    if (dice_.chance(.7)) return;
    s.aperture_radius = wild ? drawn.aperture_radius : dice_.between(0, .3);
    s.focus_distance = wild ? drawn.focus_distance : dice_.between(1, 6);
    s.aperture_scale = drawn.aperture_scale;
  }
  // In some scenes, shapes and lights are hidden from some rays.
  void visibility() {
    const bool some = dice_.chance(.2);
    const auto seen = [&] { return !some || dice_.chance(.8); };
    for (Emitter& emitter : scene_.emitters)
      std::visit(
          [&](auto& e) {
            e.visible_reflection = seen();
            e.visible_volume = seen();
          },
          emitter);
    for (Shape& s : scene_.shapes) {
      if (std::holds_alternative<NullBsdf>(scene_.bsdfs[s.bsdf.value]) && !s.emitter) continue;
      s.visible_camera = seen();
      s.visible_shadow = seen();
      s.visible_reflection = seen();
      s.visible_volume = seen();
    }
  }
  // In some scenes, lights are linked to receivers and blockers.
  void links() {
    if (!dice_.chance(.15)) return;
    const auto sets = [&] { return dice_.chance(.5) ? "one" : dice_.chance(.5) ? "two" : "one, two"; };
    const auto list = [&]() -> std::string {
      static constexpr const char* kLists[] = {"", "", "", "one", "-one", "two, -one", "none"};
      return kLists[dice_.below(std::size(kLists))];
    };
    for (Shape& s : scene_.shapes) {
      s.link_sets = sets();
      if (s.emitter) s.emitter->links = {list(), list()};
    }
    scene_.shapes.front().link_sets = "one, two";  // so that something is in each set
    for (Medium& m : scene_.media) std::visit([&](auto& medium) { medium.link_sets = sets(); }, m);
    for (Emitter& e : scene_.emitters) std::visit([&](auto& light) { light.links = {list(), list()}; }, e);
  }
  void film() {
    FilmSettings& f = scene_.film;
    draw_.any(f.filter);
    f.size = {1 + static_cast<int>(dice_.below(9)), 1 + static_cast<int>(dice_.below(9))};
    if (out_.choice.calm) f.size = {8, 8};
    if (f.size.width < 3 || f.size.height < 3 || !dice_.chance(.15)) return;
    f.crop_offset = {1, 1};
    f.crop_size = {f.size.width - 2, f.size.height - 2};
  }
  void integrator() {
    constexpr const char* kNames[] = {"volpath", "volpath_distant_mis", "path"};
    IntegratorSettings& i = scene_.integrator;
    draw_.fill(i);
    if (dice_.chance(.5)) i.path_reuse = 0;  // a number would hardly ever leave the decision to the renderer
    i.name = kNames[dice_.below(3)];
    // Without roulette paths in a white room have no end.
    if (i.max_depth < 0 || i.max_depth > 1000) i.rr_depth = std::min(i.rr_depth, 50);
    if (out_.choice.calm) {
      i.max_depth = 2 + static_cast<int>(dice_.below(3));
      i.rr_depth = 5;
      // Pixels that share light vertices or paths have errors that are alike: the mean's error is not known
      // from pixels alone (connections_test.cpp, path_reuse_test.cpp)
      i.light_vertices = -1;
      i.path_reuse = -1;
    }
    i.camera_points = std::min(i.camera_points, 8);  // more only cost time
    OthersParameters others{i.name};
    scene::describe(others, i);
    if (i.name == kNames[1]) return;
    i.distance = DistanceSampling::mis;
    i.heuristic = MisHeuristic::power;
  }
  // Resets the parameters that other integrators have.
  struct OthersParameters {
    std::string integrator;
    template <class T>
    void field(const scene::Field& f, T& x) const {
      if (f.elided && !f.belongs_to(integrator)) x = T{};
    }
  };

  RandomScene& out_;
  Scene& scene_;
  Dice& dice_;
  Draw draw_;
};

}  // namespace

RandomScene random_scene(std::uint64_t seed, const SceneChoice& choice) {
  RandomScene out;
  out.seed = seed;
  out.choice = choice;
  Dice dice(seed);
  Composer(out, dice).run();
  out.scene = scene::compacted(out.scene);
  return out;
}

SceneChoice random_choice(std::uint64_t seed) {
  Dice dice(seed ^ 0x5851f42d4c957f2d);
  SceneChoice c;
  if (dice.chance(.6)) c.wild = dice.chance(.5) ? .02 : .1;
  return c;
}

}  // namespace ls::test
