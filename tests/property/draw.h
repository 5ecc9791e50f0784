// Fills values through describe(): a visitor that sets every field to something its range contains, and makes
// the objects that fields refer to. Types that are added to the table need nothing here.
#pragma once

#include <optional>
#include <utility>
#include <variant>

#include "core/scene/schema/describe_fields.h"
#include "core/scene/schema/traits.h"
#include "tests/property/random_scene.h"
#include "tests/support/scene_builder.h"

namespace ls::test {

class Draw {
 public:
  Draw(Dice& dice, Scene& scene, RandomAssets& assets, const SceneChoice& choice)
      : dice_(dice), scene_(scene), assets_(assets), choice_(choice) {}

  template <class T>
  void fill(T& value) {
    scene::describe(*this, value);
  }
  // Any alternative, filled.
  template <class... Ts>
  void any(std::variant<Ts...>& x) {
    emplace(x, dice_.below(sizeof...(Ts)), std::index_sequence_for<Ts...>{});
    std::visit([&](auto& one) { fill(one); }, x);
  }

  TextureIndex texture(const scene::Range& range, int depth = 0);
  BsdfIndex bsdf(int depth = 0);
  VolumeIndex volume(GridKind kind);
  VolumeIndex computed_volume(GridKind kind);
  PhaseIndex phase(int depth = 0);
  MediumIndex medium();
  double number(const scene::Range& range) {
    return dice_.chance(choice_.wild) ? dice_.extreme(range) : dice_.tame(range);
  }
  Transform placement(double size, bool alike);  // within a few units of the origin
  Rgb colour(const scene::Range& range);
  bool wild() { return dice_.chance(choice_.wild); }

  // ---- what describe() calls
  template <class T>
  void field(const scene::Field& f, T& x) {
    if (f.derived && f.given_as.empty()) return;
    if (f.name.starts_with("shutter_")) return;                            // drawn with the camera's motion
    if (f.wrong == wrong_link_sets || f.wrong == wrong_link_list) return;  // drawn for the scene as a whole
    // Half of what can be left out is.
    if (!f.required && dice_.chance(.4) && !is_index(x)) return;
    draw(f, x);
  }

 private:
  template <class T>
  static constexpr bool is_index(const T&) {
    return requires(T t) { t.value = std::uint32_t{0}; };
  }
  template <class V, std::size_t... Is>
  static void emplace(V& x, std::size_t i, std::index_sequence<Is...>) {
    ((Is == i ? static_cast<void>(x.template emplace<Is>()) : void()), ...);
  }
  void share_light(DiffuseTransmissionBsdf& sheet);
  void fill_with_height_fog(HeterogeneousMedium& m);
  void draw(const scene::Field& f, double& x) { x = number(f.range); }
  void draw(const scene::Field& f, int& x) { x = static_cast<int>(number(f.range)); }
  void draw(const scene::Field& f, std::uint64_t& x) { x = static_cast<std::uint64_t>(number(f.range)); }
  void draw(const scene::Field&, bool& x) { x = dice_.chance(.5); }
  void draw(const scene::Field& f, Rgb& x) { x = colour(f.range); }
  void draw(const scene::Field& f, Vec3& x) {
    for (double& c : x) c = number(f.range);
  }
  template <class E>
  requires std::is_enum_v<E>
  void draw(const scene::Field&, E& x) {
    x = scene::NamesOf<E>::all[dice_.below(std::size(scene::NamesOf<E>::all))].value;
  }
  void draw(const scene::Field&, std::string&) {}  // names of grids: files here have none
  void draw(const scene::Field&, Transform& x) { x = placement(1, true); }
  void draw(const scene::Field&, UvTransform& x) {
    x = {{dice_.between(-3, 3), dice_.between(-1, 1), dice_.between(-1, 1), dice_.between(-1, 1),
          dice_.between(-3, 3), dice_.between(-1, 1), 0, 0, 1}};
    if (wild()) x.m[dice_.below(6)] = dice_.extreme({-1e12, 1e12});
  }
  void draw(const scene::Field& f, TextureIndex& x) { x = texture(f.range); }
  void draw(const scene::Field&, BsdfIndex& x) { x = bsdf(depth_ + 1); }
  void draw(const scene::Field& f, VolumeIndex& x) { x = volume(kind_of(f)); }
  void draw(const scene::Field&, PhaseIndex& x) { x = phase(phase_depth_ + 1); }
  void draw(const scene::Field&, std::vector<double>&) {}  // lists that must fit each other: phase()
  void draw(const scene::Field&, MediumIndex& x) { x = medium(); }
  void draw(const scene::Field&, AssetIndex&) {}  // by whoever knows what the file is for
  void draw(const scene::Field&, GroupIndex&) {}
  void draw(const scene::Field&, MeterIndex&) {}
  void draw(const scene::Field&, std::vector<MotionKey>&) {}  // by random_scene.cpp, which knows the camera
  template <class T>
  void draw(const scene::Field& f, std::optional<T>& x) {
    draw(f, x.emplace());
  }
  template <class... Ts>
  void draw(const scene::Field&, std::variant<Ts...>& x) {
    any(x);
  }
  static GridKind kind_of(const scene::Field& f) {
    return f.name == "temperature" ? GridKind::temperature
           : f.name == "sigma_t"   ? GridKind::density
                                   : GridKind::share;
  }

  Dice& dice_;
  Scene& scene_;
  RandomAssets& assets_;
  SceneChoice choice_;
  int depth_ = 0;  // of the bsdf being filled
  int phase_depth_ = 0;
};

}  // namespace ls::test
