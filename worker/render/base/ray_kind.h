// The kinds of rays from which shapes and lights can be hidden.
#pragma once

#include <cstdint>

namespace ls::render {

enum class RayKind : std::uint8_t {
  camera,   // from the camera, up to the first scattering
  shadow,   // from a vertex to a point of a light
  surface,  // scattered by a surface, or at a meter
  medium,   // scattered by a medium
  // Shadow rays of some lights only: those that are linked to other blockers (LightReach). No ray has this
  // kind; it marks the surfaces for which the light decides.
  some_shadow,
};

class RayKinds {
 public:
  bool operator==(const RayKinds&) const = default;
  constexpr bool any() const { return bits_ != 0; }
  constexpr bool has(RayKind kind) const { return (bits_ & bit(kind)) != 0; }
  constexpr void set(RayKind kind, bool on) {
    if (on) bits_ = static_cast<std::uint8_t>(bits_ | bit(kind));
  }

 private:
  static constexpr std::uint8_t bit(RayKind kind) {
    return static_cast<std::uint8_t>(1u << static_cast<unsigned>(kind));
  }
  std::uint8_t bits_ = 0;
};

// Returns the kinds of rays from which a shape or an emitter is hidden.
template <class T>
constexpr RayKinds hidden_from(const T& x) {
  RayKinds kinds;
  if constexpr (requires { x.visible_camera; }) kinds.set(RayKind::camera, !x.visible_camera);
  if constexpr (requires { x.visible_shadow; }) kinds.set(RayKind::shadow, !x.visible_shadow);
  kinds.set(RayKind::surface, !x.visible_reflection);
  kinds.set(RayKind::medium, !x.visible_volume);
  return kinds;
}

}  // namespace ls::render
