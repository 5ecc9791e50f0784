// Computes the numeric class: a digest of the build and of the results of the test computations below.
// Machines with the same digest render the same bits. Each add_ function adds the results of one kind of
// computation to the digest h.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/assets/image.h"
#include "core/base/digest.h"
#include "worker/render/base/build_id.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/geometry/accel.h"
#include "worker/render/geometry/geometry.h"
#include "worker/render/math/processor.h"
#include "worker/render/math/random.h"
#include "worker/render/media/medium.h"
#include "worker/render/numeric_class/battery_images.h"
#include "worker/render/render.h"

namespace ls::render {
namespace {

template <class T>
void add(Sha256& h, const std::vector<T>& values) {
  h.update(std::as_bytes(std::span(values)));
}

// Adds values of the functions of the math library that the renderer calls: each function at 4096 arguments.
// Square roots and divisions are left out, because IEEE 754 fixes their results on every machine.
void add_math(Sha256& h) {
  std::vector<float> v;
  RandomStream r(1);
  for (int i = 0; i < 4096; ++i) {
    const float u = r.uniform(), x = 40 * u - 20;
    v.insert(v.end(),
             {std::exp(x), std::expm1(x), std::log(u + 0x1p-30f), std::log1p(u), std::sin(x), std::cos(x),
              std::tan(u), std::atan2(u, x), std::acos(2 * u - 1), std::pow(u, 2.4f), std::erf(x / 8)});
  }
  add(h, v);
}
void add_math_in_double(Sha256& h) {
  std::vector<double> v;
  RandomStream r(3);
  for (int i = 0; i < 4096; ++i) {
    const double u = static_cast<double>(r.next() >> 11) * 0x1p-53, x = 40 * u - 20;
    // Sine and cosine have different arguments, as in the renderer. With equal arguments the compiler would
    // replace both calls by one of another function, which computes the two together.
    v.insert(v.end(), {std::exp(x), std::log(u + 0x1p-60), std::sin(x), std::cos(x + 1), std::tan(1.5 * u),
                       std::atan2(u, x), std::acos(2 * u - 1), std::pow(u, 2.4), std::erfc(x / 4),
                       std::hypot(u, x), std::expm1(x), std::log1p(u)});
  }
  add(h, v);
}

// Adds the processor's approximate 1 / x and 1 / sqrt(x), which differ between manufacturers.
void add_reciprocals(Sha256& h) {
  std::vector<float> v;
  for (int i = 1; i <= 4096; ++i) {
    const float x = static_cast<float>(i) * .37f;
    v.push_back(reciprocal_estimate(x));
    v.push_back(reciprocal_root_estimate(x));
  }
  add(h, v);
}

// Adds the triangle that each of 100,000 rays hits on a fixed bumpy mesh, and the distance of the hit.
void add_hits(Sha256& h) {
  constexpr int kSide = 48;
  Geometry g;
  RandomStream r(2);
  for (int y = 0; y <= kSide; ++y)
    for (int x = 0; x <= kSide; ++x) {
      const float height = .2f * r.uniform();
      g.positions.emplace_back(2.f * x / kSide - 1, 2.f * y / kSide - 1, height);
    }
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const std::uint32_t a = y * (kSide + 1) + x, b = a + 1, c = a + kSide + 1, d = c + 1;
      for (std::uint32_t i : {a, b, c, b, d, c}) g.indices.push_back(i);
      g.triangle_surface.insert(g.triangle_surface.end(), 2, 0);
    }
  g.positions.reserve(g.positions.size() + 2);
  g.own.triangles = {0, g.triangle_count(), g.triangle_count()};
  g.surfaces.emplace_back();
  const auto accel = Accel::build(g, 1);
  if (!accel) return;
  std::vector<std::uint32_t> hits;
  for (int i = 0; i < 100'000; ++i) {
    const float ox = 2 * r.uniform() - 1, oy = 2 * r.uniform() - 1, dx = 2 * r.uniform() - 1,
                dy = 2 * r.uniform() - 1;
    const auto id = accel->nearest({ox, oy, 1}, normalize(V3(dx, dy, -.4f)), kInfinity);
    SurfaceHit hit;
    hits.push_back(id ? id->index : kNone);
    if (id && g.complete(*id, {ox, oy, 1}, normalize(V3(dx, dy, -.4f)), hit)) {
      std::uint32_t bits;
      std::memcpy(&bits, &hit.t, sizeof bits);
      hits.push_back(bits);
    }
  }
  add(h, hits);
}

void push(std::vector<float>& v, const V3& w) { v.insert(v.end(), {w.x, w.y, w.z}); }

// Adds ray hits on spheres, which the renderer's own code intersects, and not Embree: which sphere is hit,
// where, and the uv and shading frame there.
void add_sphere_hits(Sha256& h) {
  Geometry g;
  RandomStream r(4);
  for (int i = 0; i < 64; ++i) {
    Sphere s;
    for (int k = 0; k < 3; ++k) s.center[k] = 2 * double{r.uniform()} - 1;
    s.radius = .02 + .2 * double{r.uniform()};
    g.spheres.push_back(s);
  }
  g.own.spheres = {0, 64, 64};
  g.surfaces.emplace_back();
  const auto accel = Accel::build(g, 1);
  if (!accel) return;
  std::vector<float> v;
  for (int i = 0; i < 10'000; ++i) {
    const float ox = 2 * r.uniform() - 1, oy = 2 * r.uniform() - 1, dx = r.uniform() - .5f,
                dy = r.uniform() - .5f;
    const V3 o(ox, oy, -2), d = normalize(V3(dx, dy, 1));
    const auto id = accel->nearest(o, d, kInfinity);
    v.push_back(id ? static_cast<float>(id->index) : -1);
    SurfaceHit hit;
    if (!id || !g.complete(*id, o, d, hit)) continue;
    v.insert(v.end(), {hit.t, hit.uv.x, hit.uv.y});
    for (const V3& w : {hit.p, hit.ng, hit.shading.s, hit.shading.t}) push(v, w);
  }
  add(h, v);
}

// For each kind of element that `list` lacks, adds one element of that kind, with default parameters.
template <class... Kind>
void add_missing_kinds(std::vector<std::variant<Kind...>>& list) {
  const auto add = [&](auto kind) {
    for (const auto& other : list)
      if (std::holds_alternative<decltype(kind)>(other)) return;
    list.emplace_back(kind);
  };
  (add(Kind{}), ...);
}

// Adds samples of every kind of material.
void add_bsdf_samples(Sha256& h) {
  Scene scene;
  scene.textures = {ConstantTexture{{.7, .5, .2}}, ConstantTexture{{.15, .15, .15}},
                    ConstantTexture{{.4, .4, .4}}};
  const TextureIndex colour{0}, smooth{1}, rough{2};
  const Rgb eta{.14, .37, 1.44}, k{3.98, 2.38, 1.6};
  scene.bsdfs = {DiffuseBsdf{colour}, ConductorBsdf{eta, k, colour}, DielectricBsdf{1.5, 1, colour, colour}};
  for (const Microfacet type : {Microfacet::ggx, Microfacet::beckmann}) {
    scene.bsdfs.push_back(RoughConductorBsdf{type, smooth, rough, eta, k, colour});
    scene.bsdfs.push_back(RoughPlasticBsdf{type, .2, 1.5, 1, true, colour, colour});
    scene.bsdfs.push_back(RoughDielectricBsdf{type, smooth, rough, 1.5, 1, colour, colour});
  }
  scene.bsdfs.push_back(ThinDielectricBsdf{1.5, 1, colour, colour});
  scene.bsdfs.push_back(DiffuseTransmissionBsdf{smooth, colour});
  scene.bsdfs.push_back(RoughThinDielectricBsdf{Microfacet::ggx, smooth, rough, 1.5, 1, colour, colour});
  scene.bsdfs.push_back(PlasticBsdf{1.5, 1, true, colour, colour});
  scene.bsdfs.push_back(CoatedConductorBsdf{1.5, 1, 0, 0, 0, eta, k, colour});
  scene.bsdfs.push_back(CoatedConductorBsdf{1.5, 1, .1, .2, .3, eta, k, colour});
  scene.bsdfs.push_back(NormalMapBsdf{colour, {0}});
  add_missing_kinds(scene.bsdfs);
  const auto textures = TextureTable::build(scene, {});
  if (!textures) return;
  const auto bsdfs = BsdfTable::build(scene, *textures);
  if (!bsdfs) return;
  std::vector<float> v;
  RandomStream r(5);
  for (std::uint32_t b = 0; b < scene.bsdfs.size(); ++b) {
    for (int i = 0; i < 1000; ++i) {
      const float z = 1 - r.uniform(), angle = kTwoPi * r.uniform(), sine = safe_sqrt(1 - z * z);
      const float lobe = r.uniform(), x = r.uniform(), y = r.uniform();
      const V3 wo(sine * std::cos(angle), sine * std::sin(angle), z);
      const auto s = bsdfs->sample({b}, V2(0, 0), wo, lobe, {x, y});
      if (!s) continue;
      push(v, s->wi);
      push(v, s->weight);
      const BsdfEval e = bsdfs->eval({b}, V2(0, 0), wo, s->wi);
      push(v, e.f_cos);
      v.insert(v.end(), {s->pdf, e.pdf});
    }
  }
  add(h, v);
}

std::vector<std::byte> bytes_of(std::string_view hex) {
  std::vector<std::byte> bytes(hex.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    unsigned value = 0;
    std::from_chars(&hex[2 * i], &hex[2 * i] + 2, value, 16);
    bytes[i] = static_cast<std::byte>(value);
  }
  return bytes;
}

// Adds the pixels that lossy image decoders return. The decoders' transforms round differently depending on
// the version of the library and on the processor's instruction set.
void add_decoded_images(Sha256& h) {
  for (const std::string_view picture : {battery::kJpeg, battery::kDwa, battery::kB44, battery::kPxr24}) {
    const auto image = decode_image("battery", bytes_of(picture));
    if (!image) {
      h.update(image.error().message);
      continue;
    }
    add(h, image->u8);
    add(h, image->f32);
  }
}

Digest compute() {
  Sha256 h;
  h.update(kBuildId);
  h.update(Accel::describe());
  add_math(h);
  add_math_in_double(h);
  add_reciprocals(h);
  add_hits(h);
  add_sphere_hits(h);
  add_bsdf_samples(h);
  add_decoded_images(h);
  return h.finish();
}

}  // namespace

const Digest& numeric_class() {
  static const Digest digest = compute();
  return digest;
}

const std::string& platform() {
  static const std::string words = fmt::format("{}:embree-{}", LIGHTSHAFT_PLATFORM, Accel::version());
  return words;
}

}  // namespace ls::render
