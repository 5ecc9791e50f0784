// Makes environment maps of small images.
#pragma once

#include <stdexcept>
#include <utility>

#include "tests/support/scene_builder.h"
#include "worker/render/lights/envmap.h"

namespace ls::render {

inline ImageData data(const test::SkyImage& s) {
  ImageData d;
  d.width = static_cast<std::uint32_t>(s.width);
  d.height = static_cast<std::uint32_t>(s.height);
  d.channels = 3;
  d.f32 = s.rgb;
  return d;
}
inline Result<EnvironmentMap> try_map(const test::SkyImage& s, const Transform& t = {}, double scale = 1) {
  return EnvironmentMap::build("sky.exr", data(s), scale, t);
}
inline EnvironmentMap map_of(const test::SkyImage& s, const Transform& t = {}, double scale = 1) {
  auto m = try_map(s, t, scale);
  if (!m) throw std::runtime_error(m.error().message);
  return std::move(*m);
}

}  // namespace ls::render
