// The numeric class: machines that agree on the build and on every bit of this battery render the same bits.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <immintrin.h>

#include "common/base/digest.h"
#include "worker/render/accel.h"
#include "worker/render/build_id.h"
#include "worker/render/geometry.h"
#include "worker/render/hash.h"
#include "worker/render/medium.h"
#include "worker/render/render.h"

namespace ls::render {
namespace {

template <class T>
void add(Sha256& h, const std::vector<T>& values) {
  h.update(std::as_bytes(std::span(values)));
}

// The mathematical library's values, at 4096 arguments each.
void add_math(Sha256& h) {
  std::vector<float> v;
  RandomStream r(1);
  for (int i = 0; i < 4096; ++i) {
    const float u = r.uniform(), x = 40 * u - 20;
    for (float y :
         {std::exp(x), std::expm1(x), std::log(u + 0x1p-30f), std::log1p(u), std::sin(x), std::cos(x),
          std::tan(u), std::atan2(u, x), std::acos(2 * u - 1), std::sqrt(u), std::pow(u, 2.4f)}) {
      v.push_back(y);
    }
  }
  add(h, v);
}

// The processor's reciprocal estimates, which Embree uses and makers implement differently.
void add_reciprocals(Sha256& h) {
  std::vector<float> v;
  for (int i = 1; i <= 4096; ++i) {
    const __m128 x = _mm_set_ss(static_cast<float>(i) * .37f);
    v.push_back(_mm_cvtss_f32(_mm_rcp_ss(x)));
    v.push_back(_mm_cvtss_f32(_mm_rsqrt_ss(x)));
  }
  add(h, v);
}

// 100,000 rays through a fixed bumpy mesh: which triangle is met.
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
  g.opaque_triangles = g.triangle_count();
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

Digest compute() {
  Sha256 h;
  h.update(kBuildId);
  h.update(Accel::describe());
  add_math(h);
  add_reciprocals(h);
  add_hits(h);
  return h.finish();
}

}  // namespace

const Digest& numeric_class() {
  static const Digest digest = compute();
  return digest;
}

}  // namespace ls::render
