// Rendered pictures with AOVs, and scenes for them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/image/aov/aov.h"
#include "core/image/aov/identifiers.h"
#include "tests/support/render_check.h"

namespace ls::render {

inline constexpr std::uint64_t kSamples = 16;
// Tests compare positions in a world of unit size, uv and unit vectors. They are float32 after a few
// operations each. 2^-20 of the largest of them is 16 units in the last place.
inline constexpr double kClose = 0x1p-20;

// A picture with AOVs. Its functions return, by the plane's name, sums over the samples of a pixel, and means
// over all its samples or over those that hit a surface.
class Picture {
 public:
  Picture(const test::SceneBuilder& builder, std::vector<std::string> names, std::uint64_t samples = kSamples,
          int deep = 0)
      : samples_(samples) {
    RenderSettings settings = test::settings_of(builder.scene);
    settings.aov = names_of(parse_aovs(names).value());
    settings.deep = deep;
    aovs_ = planes_of(aovs_of(settings));
    size_ = settings.size;
    auto world = build_world(builder.scene, settings, builder.files, 1);
    if (!world) throw std::runtime_error(world.error().message);
    sums_ = render_tile(**world, {0, 0, size_.width, size_.height}, {0, samples}, nullptr, nullptr).sums;
  }
  std::size_t pixels() const { return static_cast<std::size_t>(size_.width * size_.height); }
  std::vector<float> beauty() const {
    return {sums_.begin(), sums_.begin() + static_cast<std::ptrdiff_t>(6 * pixels())};
  }
  double sum(const std::string& plane, std::size_t pixel) const {
    const auto at = std::find(aovs_.names.begin(), aovs_.names.end(), plane);
    if (at == aovs_.names.end()) throw std::runtime_error("no plane " + plane);
    return sums_[(6 + static_cast<std::size_t>(at - aovs_.names.begin())) * pixels() + pixel];
  }
  double of_all(const std::string& plane, std::size_t pixel = 0) const {
    return sum(plane, pixel) / static_cast<double>(samples_);
  }
  double of_hits(const std::string& plane, std::size_t pixel = 0) const {
    return sum(plane, pixel) / sum("aov.hits", pixel);
  }
  // The sum of a channel of the colour over half A (0) or B (1) of the samples, and over both
  double half(std::size_t h, std::size_t channel, std::size_t pixel) const {
    return double{sums_[(3 * h + channel) * pixels() + pixel]};
  }
  double whole(std::size_t channel, std::size_t pixel) const {
    return half(0, channel, pixel) + half(1, channel, pixel);
  }
  IdSlots ids(std::size_t which, std::size_t pixel = 0) const {
    return load_slots(&sums_[(6 + aovs_.all_sums() + which * kIdPlanes) * pixels() + pixel], pixels());
  }

 private:
  std::uint64_t samples_;
  AovPlanes aovs_;
  FrameSize size_;
  std::vector<float> sums_;
};

// A wall of side 4 in the plane z = 0, moved by `at`. The camera looks straight at its point (x, y) from a
// distance of 5.
inline test::SceneBuilder wall(double x = .4, double y = .6, const Vec3& at = {0, 0, 0}) {
  using test::operator*;
  test::SceneBuilder builder({2, 2});
  builder.shape(RectangleShape{}, test::translate(at) * test::scale(2), builder.diffuse(.3));
  builder.environment();
  builder.look({at[0] + x, at[1] + y, at[2] + 5}, {at[0] + x, at[1] + y, at[2]}, 1e-3, {0, 1, 0});
  return builder;
}
// A floor with a ball of glass and, with `media`, a box of fog: homogeneous, or a grid with `grids`. An area
// light, a point light and a constant environment of radiance .1 light it.
inline test::SceneBuilder hall(bool media, bool grids) {
  using test::operator*;
  test::SceneBuilder builder({8, 6});
  const BsdfIndex white = builder.diffuse(.7);
  builder.shape(RectangleShape{}, test::translate({0, 0, -1}) * test::scale(3), white);
  builder.shape(SphereShape{}, test::translate({.6, .8, -.5}) * test::scale(.4), builder.glass(1.5));
  builder.shape(RectangleShape{}, test::translate({0, 0, 2}) * test::rotate_x(180) * test::scale(.5), white)
      .emitter = AreaEmitter{builder.texture({3, 2, 1})};
  builder.scene.emitters.push_back(PointEmitter{{1, -1, 1}, {1, 1, 1}});
  builder.environment(.1);
  if (media) {
    const Transform box = test::translate({-1, -1, -1}) * test::scale(2);
    const MediumIndex m =
        grids ? builder.heterogeneous(builder.grid({2, 2, 2}, {1, 2, 3, 1, .5f, 1, 2, 0}, box), {.9, .6, .3},
                                      1, .4)
              : builder.homogeneous({.8, .9, 1}, {.9, .5, .2}, .3);
    builder.container(CubeShape{}, test::scale(.9), builder.null(), m);
  }
  builder.look({0, -5, 1}, {0, 0, 0}, 40);
  return builder;
}

}  // namespace ls::render
