#include "tests/property/moved.h"

#include <algorithm>

#include "core/base/overloaded.h"
#include "core/scene/schema/describe_fields.h"

namespace ls::test {
namespace {

class Mover {
 public:
  explicit Mover(const Move& m) : m_(m), all_(translate(m.shift) * ls::test::scale(m.scale) * m.turn) {}

  void place(Transform& t) const { t = all_ * t; }
  // Of what may not be stretched: its origin moves, its axes turn.
  void place_rigid(Transform& t) const {
    const Transform at = all_ * t;
    t = m_.turn * t;
    for (std::size_t row = 0; row < 3; ++row) t.m[4 * row + 3] = at.m[4 * row + 3];
  }
  Vec3 point(const Vec3& p) const { return column(all_ * translate(p)); }
  Vec3 direction(const Vec3& d) const { return column(m_.turn * translate(d)); }
  double area() const { return m_.scale * m_.scale; }
  double length() const { return m_.scale; }

 private:
  static Vec3 column(const Transform& t) { return {t.m[3], t.m[7], t.m[11]}; }
  Move m_;
  Transform all_;
};

Rgb times(const Rgb& c, double k) { return {c[0] * k, c[1] * k, c[2] * k}; }

// Kinds of emitters call the same things by the same names.
void move(const Mover& m, Emitter& e) {
  std::visit(
      [&](auto& light) {
        if constexpr (requires { light.direction; }) light.direction = m.direction(light.direction);
        if constexpr (requires { light.position; }) light.position = m.point(light.position);
        if constexpr (requires { light.to_world; }) m.place_rigid(light.to_world);
        if constexpr (requires { light.intensity; }) light.intensity = times(light.intensity, m.area());
        if constexpr (std::is_same_v<decltype(light), ProjectorEmitter&>) light.scale *= m.area();
      },
      e);
}

void move(const Mover& m, Medium& medium) {
  std::visit(overloaded{[&](HomogeneousMedium& h) {
                          h.scale /= m.length();
                          h.emission = times(h.emission, 1 / m.length());
                        },
                        [&](HeterogeneousMedium& h) {
                          h.scale /= m.length();
                          if (h.emission) h.emission_scale /= m.length();
                        }},
             medium);
}

void move(const Mover& m, Sensor& s) {
  s.aperture_radius *= m.length();
  s.focus_distance *= m.length();
  if (s.projection == Projection::orthographic) {
    // Its near plane is where to_world puts it; from there rays reach far - near.
    s.far_clip = s.near_clip + (s.far_clip - s.near_clip) * m.length();
    m.place(s.to_world);
    for (MotionKey& key : s.motion) m.place(key.to_world);
  } else {
    s.near_clip *= m.length();
    s.far_clip *= m.length();
    m.place_rigid(s.to_world);
    for (MotionKey& key : s.motion) m.place_rigid(key.to_world);
  }
}

// Visits every colour of what describe() knows.
class Permuter {
 public:
  explicit Permuter(std::array<std::size_t, 3> from) : from_(from) {}
  template <class T>
  void field(const scene::Field&, T& x) {
    walk(x);
  }

 private:
  void walk(Rgb& c) { c = {c[from_[0]], c[from_[1]], c[from_[2]]}; }
  template <class T>
  void walk(std::vector<T>& list) {
    for (T& x : list) walk(x);
  }
  template <class T>
  void walk(std::optional<T>& x) {
    if (x) walk(*x);
  }
  template <class... Ts>
  void walk(std::variant<Ts...>& x) {
    std::visit([&](auto& one) { scene::describe(*this, one); }, x);
  }
  template <class T>
  void walk(T& x) {
    if constexpr (scene::Described<T>) scene::describe(*this, x);
  }
  std::array<std::size_t, 3> from_;
};

}  // namespace

Scene moved(Scene s, const Move& move_by) {
  const Mover m(move_by);
  const auto place = [&](auto& object) {
    m.place(object.to_world);
    for (MotionKey& key : object.motion) m.place(key.to_world);
  };
  for (Shape& shape : s.shapes)
    if (!shape.group) place(shape);
  for (Instance& i : s.instances) place(i);
  for (Volume& v : s.volumes)
    std::visit(
        [&](auto& one) {
          if constexpr (requires { one.to_world; }) m.place(one.to_world);
        },
        v);
  for (Bsdf& b : s.bsdfs)
    if (auto* bump = std::get_if<BumpMapBsdf>(&b)) bump->scale *= m.length();
  for (Medium& medium : s.media) move(m, medium);
  for (Emitter& e : s.emitters) move(m, e);
  move(m, s.sensor);
  return s;
}

Scene permuted(Scene s, std::array<std::size_t, 3> from) {
  Permuter p(from);
  scene::describe(p, s);
  return s;
}

bool can_be_permuted(const Scene& s) {
  const auto weighs = [](const Bsdf& b) {
    return std::holds_alternative<MaskBsdf>(b) || std::holds_alternative<BlendBsdf>(b) ||
           std::holds_alternative<NormalMapBsdf>(b) || std::holds_alternative<PrincipledBsdf>(b) ||
           std::holds_alternative<RoughConductorBsdf>(b) || std::holds_alternative<RoughDielectricBsdf>(b) ||
           std::holds_alternative<RoughThinDielectricBsdf>(b);
  };
  const auto glows = [](const Medium& m) {
    const auto* h = std::get_if<HeterogeneousMedium>(&m);
    return h && h->temperature;
  };
  const auto chooses_colours = [](const Phase& p) {
    const auto* table = std::get_if<TabulatedPhase>(&p);
    return table && table->values.empty();
  };
  return s.assets.empty() && std::none_of(s.phases.begin(), s.phases.end(), chooses_colours) &&
         std::none_of(s.bsdfs.begin(), s.bsdfs.end(), weighs) &&
         std::none_of(s.media.begin(), s.media.end(), glows);
}

}  // namespace ls::test
