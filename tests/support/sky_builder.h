// Environment maps for scenes made by hand, and the irradiance of those that have a closed form.
#pragma once

#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/image/exr/exr_file.h"
#include "tests/support/scene_builder.h"

namespace ls::test {

// An image under construction: black, linear RGB, texel (0, 0) at the upper left.
struct SkyImage {
  int width, height;
  std::vector<float> rgb;

  SkyImage(int w, int h, float value = 0)
      : width(w), height(h), rgb(3 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h), value) {}
  void set(int x, int y, const Rgb& c) {
    for (std::size_t k = 0; k < 3; ++k) {
      rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) +
          k] = static_cast<float>(c[k]);
    }
  }
  void set_row(int y, const Rgb& c) {
    for (int x = 0; x < width; ++x) set(x, y, c);
  }
};

// As a file of floats.
inline AssetIndex add_image(SceneBuilder& builder, const SkyImage& image) {
  static const ScratchFolder folder;
  ExrPicture picture;
  picture.size = {image.width, image.height};
  const char* names[] = {"R", "G", "B"};
  for (std::size_t c = 0; c < 3; ++c) {
    ExrFloat plane;
    for (std::size_t i = c; i < image.rgb.size(); i += 3) plane.values.push_back(image.rgb[i]);
    picture.channels[names[c]] = std::move(plane);
  }
  const auto bytes = write_exr(picture);
  if (!bytes) throw std::runtime_error(bytes.error().message);
  const Asset asset{"sky.exr", sha256(*bytes), bytes->size()};
  const auto path = folder.path() / asset.digest.hex();
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
  builder.files[asset.digest] = path;
  return SceneBuilder::push<AssetTag>(builder.scene.assets, asset);
}

// The kit's environment from now on.
inline void add_sky(SceneBuilder& builder, const SkyImage& image, const Transform& to_world = {},
                    double scale = 1) {
  EnvmapEmitter e;
  e.file = add_image(builder, image);
  e.to_world = to_world;
  e.scale = scale;
  builder.scene.emitters.push_back(e);
}

// The integral of direction x radiance over all directions of a map that is 1 in texel (x, y), not at a pole,
// and black elsewhere: irradiance of a plane is its product with the normal, if all of it lies above the
// plane. A texel is a tent of half widths w = 2 pi / width in the azimuth p and h = pi / (height - 1) in the
// polar angle q, and a tent about a takes cos(k a) to its width times cos(k a) (sin(k w / 2) / (k w / 2))^2:
//   d = (sin p sin q, cos q, -cos p sin q), solid angle sin q dq dp.
inline Vec3 one_texel_irradiance(int width, int height, int x, int y) {
  const double w = 2 * kPi / width, h = kPi / (height - 1), p = (x + .5) * w, q = y * h;
  const auto tent = [](double a) { return std::sin(a) * std::sin(a) / (a * a); };
  const double across = w * tent(w / 2), sine2 = h / 2 * (1 - std::cos(2 * q) * tent(h)),
               sine_cosine = h / 2 * std::sin(2 * q) * tent(h);
  return {std::sin(p) * across * sine2, w * sine_cosine, -std::cos(p) * across * sine2};
}

}  // namespace ls::test
