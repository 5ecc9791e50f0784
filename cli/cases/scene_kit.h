// Scenes made by hand, and the grid files they need: for the cases of `lightshaft validate` and for tests of
// the renderer.
#pragma once

#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/scene/scene.h"
#include "worker/render/render.h"

namespace ls::cases {

inline constexpr double kPi = 3.14159265358979323846;

// ---- transforms: later ones act first, as in a product of matrices
inline Transform operator*(const Transform& a, const Transform& b) {
  Transform r;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      double sum = 0;
      for (int k = 0; k < 4; ++k) sum += a.m[4 * i + k] * b.m[4 * k + j];
      r.m[4 * i + j] = sum;
    }
  return r;
}
inline Transform translate(const Vec3& t) {
  return {{1, 0, 0, t[0], 0, 1, 0, t[1], 0, 0, 1, t[2], 0, 0, 0, 1}};
}
inline Transform scale(double x, double y, double z) {
  return {{x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1}};
}
inline Transform scale(double s) { return scale(s, s, s); }
inline Transform rotate_x(double degrees) {
  const double a = degrees * kPi / 180, c = std::cos(a), s = std::sin(a);
  return {{1, 0, 0, 0, 0, c, -s, 0, 0, s, c, 0, 0, 0, 0, 1}};
}
inline Transform rotate_y(double degrees) {
  const double a = degrees * kPi / 180, c = std::cos(a), s = std::sin(a);
  return {{c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0, 0, 0, 0, 1}};
}
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vec3 unit(const Vec3& v) {
  const double l = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  return {v[0] / l, v[1] / l, v[2] / l};
}
// The columns of the camera: to its left, up, and ahead (Mitsuba's look_at).
inline Transform look_at(const Vec3& o, const Vec3& target, const Vec3& up) {
  const Vec3 d = unit({target[0] - o[0], target[1] - o[1], target[2] - o[2]});
  const Vec3 l = unit(cross(up, d)), u = cross(d, l);
  return {{l[0], u[0], d[0], o[0], l[1], u[1], d[1], o[1], l[2], u[2], d[2], o[2], 0, 0, 0, 1}};
}

// A folder that goes with the process: grids for scenes.
class ScratchFolder {
 public:
  ScratchFolder() {
    static std::atomic<int> count{0};
    path_ = std::filesystem::temp_directory_path() /
            ("lightshaft-scratch-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ec;
    std::filesystem::remove_all(path_, ec);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// A scene under construction. Black film, box filter, no lights, no depth limit.
struct SceneKit {
  Scene scene;
  render::AssetFiles files;

  explicit SceneKit(FrameSize size = {16, 16}) {
    scene.film.size = size;
    scene.film.filter = BoxFilter{};
  }
  template <class Tag, class T, class V>
  static Index<Tag> push(std::vector<T>& list, const V& v) {
    list.push_back(v);
    return {static_cast<std::uint32_t>(list.size() - 1)};
  }
  TextureIndex texture(const Rgb& c) { return push<TextureTag>(scene.textures, ConstantTexture{c}); }
  BsdfIndex bsdf(const Bsdf& b) { return push<BsdfTag>(scene.bsdfs, b); }
  BsdfIndex diffuse(double r) { return bsdf(DiffuseBsdf{texture({r, r, r})}); }
  BsdfIndex mirror() {  // reflects everything, on both sides
    const BsdfIndex m = bsdf(ConductorBsdf{{0, 0, 0}, {1, 1, 1}, texture({1, 1, 1})});
    return bsdf(TwoSidedBsdf{m, m});
  }
  BsdfIndex glass(double ior) {
    const TextureIndex white = texture({1, 1, 1});
    return bsdf(DielectricBsdf{ior, 1, white, white});
  }
  BsdfIndex null() { return bsdf(NullBsdf{}); }
  PhaseIndex phase(double g) {
    return g == 0 ? push<PhaseTag>(scene.phases, IsotropicPhase{}) : push<PhaseTag>(scene.phases, HgPhase{g});
  }
  MediumIndex homogeneous(const Rgb& sigma_t, const Rgb& albedo, double g = 0) {
    return push<MediumTag>(scene.media, HomogeneousMedium{sigma_t, albedo, 1, phase(g)});
  }
  VolumeIndex constant(const Rgb& v, const Transform& to_world = {}) {
    return push<VolumeTag>(scene.volumes, ConstVolume{v, to_world});
  }
  // nx * ny * nz values at the centres of the voxels of the unit cube, x fastest, moved by to_world. Of
  // several channels the values are interleaved.
  VolumeIndex grid(std::array<int, 3> n, const std::vector<float>& values, const Transform& to_world,
                   int channels = 1) {
    static const ScratchFolder folder;
    std::string bytes = "VOL\3";
    const auto put = [&](auto v) { bytes.append(reinterpret_cast<const char*>(&v), sizeof v); };
    for (const std::int32_t v : {1, n[0], n[1], n[2], channels}) put(v);
    for (const float v : {0.f, 0.f, 0.f, 1.f, 1.f, 1.f}) put(v);
    for (const float v : values) put(v);
    const Asset asset{"grid.vol", sha256(bytes), bytes.size()};
    const auto path = folder.path() / asset.digest.hex();
    std::ofstream(path, std::ios::binary) << bytes;
    files[asset.digest] = path;
    GridVolume g;
    g.file = push<AssetTag>(scene.assets, asset);
    g.to_world = to_world;
    return push<VolumeTag>(scene.volumes, g);
  }
  MediumIndex heterogeneous(VolumeIndex sigma_t, const Rgb& albedo, double scale = 1, double g = 0) {
    const VolumeIndex a = constant(albedo);
    return push<MediumTag>(scene.media, HeterogeneousMedium{sigma_t, a, scale, phase(g)});
  }
  // Makes a medium, of either kind, give off this radiance per length.
  void glow(MediumIndex medium, const Rgb& radiance) {
    auto& made = scene.media[medium.value];
    if (auto* grid = std::get_if<HeterogeneousMedium>(&made))
      grid->emission = constant(radiance);
    else
      std::get<HomogeneousMedium>(made).emission = radiance;
  }
  Shape& shape(const Geometry& g, const Transform& to_world, BsdfIndex bsdf) {
    Shape s;
    s.geometry = g;
    s.to_world = to_world;
    s.bsdf = bsdf;
    scene.shapes.push_back(s);
    return scene.shapes.back();
  }
  Shape& container(const Geometry& g, const Transform& to_world, BsdfIndex bsdf, MediumIndex inside) {
    Shape& s = shape(g, to_world, bsdf);
    s.interior = inside;
    s.is_medium_transition = true;
    return s;
  }
  void environment(double radiance = 1) {
    scene.emitters.push_back(ConstantEmitter{{radiance, radiance, radiance}});
  }
  // A needle of a view: every pixel sees all but the same ray.
  void look(const Vec3& from, const Vec3& to, double fov = 1e-3, const Vec3& up = {0, 0, 1}) {
    scene.sensor.to_world = look_at(from, to, up);
    scene.sensor.fov = fov;
    scene.sensor.near_clip = 1e-6;
    scene.sensor.far_clip = 1e8;
  }
};

}  // namespace ls::cases
