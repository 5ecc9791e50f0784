#include "worker/render/render.h"

#include <array>
#include <bit>
#include <cmath>
#include <memory>

#include "worker/render/integrator/aov_pixel.h"
#include "worker/render/integrator/light_paths.h"
#include "worker/render/integrator/variant.h"
#include "worker/render/math/processor.h"
#include "worker/render/math/rounded.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

// The variants of the integrators `volpath` and `path`, cheapest first. The last one has the
// features of every scene.
constexpr Variant kVariants[] = {
    variant<Features{}>("surfaces"),
    variant<Features{.passing = true}>("surfaces that light passes"),
    variant<Features{.media = true, .passing = true}>("homogeneous grey media"),
    variant<Features{.media = true, .chromatic = true, .passing = true}>("homogeneous chromatic media"),
    variant<Features{.media = true, .grids = true, .passing = true}>("grey grids"),
    variant<Features{.media = true, .grids = true, .chromatic = true, .passing = true}>("chromatic grids"),
    variant<kEveryScene>("everything"),
};
static_assert(std::end(kVariants)[-1].covers == kEveryScene);

std::span<const Variant> variants_for(const World& w) {
  if (w.need.connected) return connected_variants();
  if (w.need.aimed) return aimed_variants();
  if (w.need.whitted) return whitted_variants();
  return w.distant_mis ? distant_variants() : std::span<const Variant>(kVariants);
}
const Variant& split_variant(const World& w) {
  if (w.need.connected) return kConnectedSplitVariant;
  if (w.need.aimed) return kAimedSplitVariant;
  if (w.need.whitted) return kWhittedSplitVariant;
  return w.distant_mis ? kDistantSplitVariant : kSplitVariant;
}
const Variant& choose(const World& w) {
  for (const Variant& v : variants_for(w)) {
    if (v.covers.covers(w.need)) return v;
  }
  return split_variant(w);
}

// The largest usable radiance: 2^31 samples of it can be summed in float32. A larger sample is an error of
// the scene: adding it could make the sums of a whole unit (a tile and a range of samples) infinite, and
// rendering the unit again would not help. NaN fails the test too. The limit applies to single samples, so
// that rejection does not depend on how samples are grouped.
constexpr float kLargestRadiance = 0x1p96f;
bool usable(const SampleOutcome& s) {
  const C3& c = s.radiance;
  return std::abs(c.x) <= kLargestRadiance && std::abs(c.y) <= kLargestRadiance &&
         std::abs(c.z) <= kLargestRadiance && s.cut_off == HealthCause::none;
}
// True if the sample is usable and needs no counting, as nearly every sample. Floats from 0 up to the limit
// have the same order as their bit patterns; negative floats and NaN have larger patterns.
bool clean(const SampleOutcome& s) {
  const auto fine = [](float x) {
    return std::bit_cast<std::uint32_t>(x) <= std::bit_cast<std::uint32_t>(kLargestRadiance);
  };
  const C3& c = s.radiance;
  return fine(c.x) && fine(c.y) && fine(c.z) && s.cut_off == HealthCause::none && s.majorant_violations == 0;
}
bool negative(const SampleOutcome& s) { return s.radiance.x < 0 || s.radiance.y < 0 || s.radiance.z < 0; }

// The reason why the sample is not usable, or HealthCause::none if it is usable.
HealthCause rejected_for(const SampleOutcome& s) {
  if (usable(s) || s.cut_off != HealthCause::none) return s.cut_off;
  const C3& c = s.radiance;
  if (std::isnan(c.x) || std::isnan(c.y) || std::isnan(c.z)) return HealthCause::not_a_number;
  return is_finite(c) ? HealthCause::too_large : HealthCause::infinite;
}

// Counts the problems of the sample at `spot` in `health`. Not inlined, to keep this code out of the path of
// good samples.
[[gnu::cold, gnu::noinline]] void count(const SampleOutcome& s, const HealthLocation& spot, Health& health) {
  health.add(HealthCause::majorant_violation, s.majorant_violations, spot);
  const HealthCause cause = rejected_for(s);
  health.add(cause, 1, spot);
  if (cause == HealthCause::none && negative(s)) health.add(HealthCause::negative, 1, spot);
}

// Provides the connections for samples of a world. It holds the light vertices of the last sample of each
// half, so that the cache is asked only when the set changes.
class SampleConnections {
 public:
  explicit SampleConnections(const World& w) : w_(w) {}
  Connections of(std::uint64_t sample) {
    if (!w_.need.connected) return {};
    Kept& kept = kept_[sample & 1];
    const std::uint64_t set = LightVertexCache::set_of(sample);
    if (!kept.vertices || kept.set != set)
      kept = {set, w_.light_vertices.get(set, [&](std::uint64_t s) { return trace_light_vertices(w_, s); })};
    return {.vertices = kept.vertices.get()};
  }

 private:
  struct Kept {
    std::uint64_t set = 0;
    std::shared_ptr<const LightVertices> vertices;
  };
  const World& w_;
  std::array<Kept, 2> kept_;
};

struct PixelSums {
  double half[2][3] = {};
};

// What a pixel accumulates beside the colour sums: nothing (NoAovs), or AOVs (AovPixel).
struct NoAovs {
  static LightSplit* split() { return nullptr; }
  static void begin_pixel() {}
  static void begin_sample() {}
  static void end_sample(int, int, std::uint64_t, bool) {}
  static void store(float*, std::size_t, std::size_t) {}
};

template <class Aovs>
PixelSums render_pixel(const World& w, SampleFn sample, int x, int y, SampleRange range,
                       SampleConnections& connections, Health& health, Breadcrumb* crumb, Aovs& aovs) {
  PixelSums sums;
  for (std::uint64_t s = range.s0; s < range.s1; ++s) {
    if (crumb) crumb->sample.store(s, std::memory_order_relaxed);
    aovs.begin_sample();
    const SampleOutcome out = sample(w, x, y, s, aovs.split(), connections.of(s));
    aovs.end_sample(x, y, s, usable(out));
    // A bad sample is counted in the health and contributes zero to the pixel. It remains one of the pixel's
    // N samples and is never replaced.
    if (!clean(out)) [[unlikely]] {
      count(out, {x, y, s}, health);
      if (!usable(out)) continue;
    }
    for (int c = 0; c < 3; ++c) sums.half[s & 1][c] += static_cast<double>(out.radiance[c]);
  }
  return sums;
}

template <class Aovs>
TileResult render_tile_with(const World& w, SampleFn sample, PixelRect tile, SampleRange range,
                            const std::atomic<bool>* stop, Breadcrumb* crumb, Aovs aovs) {
  const FlushDenormals mode;
  SampleConnections connections(w);
  TileResult r;
  const auto pixels = static_cast<std::size_t>(tile.pixels());
  r.sums.assign((6 + planes_of(w.aovs).count()) * pixels, 0.f);
  std::size_t i = 0;
  for (int y = tile.y0; y < tile.y1; ++y) {
    if (stop && stop->load(std::memory_order_relaxed)) {
      r.stopped = true;
      return r;
    }
    for (int x = tile.x0; x < tile.x1; ++x, ++i) {
      if (crumb) {
        crumb->x.store(x, std::memory_order_relaxed);
        crumb->y.store(y, std::memory_order_relaxed);
      }
      aovs.begin_pixel();
      const PixelSums sums = render_pixel(w, sample, x, y, range, connections, r.health, crumb, aovs);
      aovs.store(r.sums.data() + 6 * pixels, pixels, i);
      for (std::size_t h = 0; h < 2; ++h)
        for (std::size_t c = 0; c < 3; ++c) r.sums[(3 * h + c) * pixels + i] = rounded(sums.half[h][c]);
    }
  }
  return r;
}
TileResult render_tile_with(const World& w, SampleFn sample, PixelRect tile, SampleRange range,
                            const std::atomic<bool>* stop, Breadcrumb* crumb) {
  if (w.aovs.empty()) return render_tile_with(w, sample, tile, range, stop, crumb, NoAovs{});
  return render_tile_with(w, sample, tile, range, stop, crumb, AovPixel(w));
}

// Renders with a variant that computes light components, whether or not the settings request them.
TileResult render_split(const World& w, const Variant& v, PixelRect tile, SampleRange range) {
  return render_tile_with(w, v.sample, tile, range, nullptr, nullptr, AovPixel(w));
}

}  // namespace

TileResult render_tile(const World& world, PixelRect tile, SampleRange samples, const std::atomic<bool>* stop,
                       Breadcrumb* breadcrumb) {
  return render_tile_with(world, choose(world).sample, tile, samples, stop, breadcrumb);
}

std::vector<std::string> all_variants(const World& world) {
  std::vector<std::string> names;
  for (const Variant& v : variants_for(world)) names.emplace_back(v.name);
  names.emplace_back(split_variant(world).name);
  return names;
}

std::vector<std::string> covering_variants(const World& world) {
  std::vector<std::string> names;
  for (const Variant& v : variants_for(world)) {
    if (v.covers.covers(world.need)) names.emplace_back(v.name);
  }
  names.emplace_back(split_variant(world).name);
  return names;
}

TileResult render_tile_as(const World& world, const std::string& name, PixelRect tile, SampleRange samples) {
  for (const Variant& v : variants_for(world)) {
    if (name == v.name) return render_tile_with(world, v.sample, tile, samples, nullptr, nullptr);
  }
  const Variant& split = split_variant(world);
  if (name == split.name) return render_split(world, split, tile, samples);
  return {};
}

SampleValue render_sample(const World& world, int x, int y, std::uint64_t sample) {
  const FlushDenormals mode;
  LightSplit split;
  split.fill(C3(0));
  const SampleOutcome out =
      choose(world).sample(world, x, y, sample, &split, SampleConnections(world).of(sample));
  SampleValue value{{out.radiance.x, out.radiance.y, out.radiance.z}, usable(out), {}};
  count(out, {x, y, sample}, value.health);
  return value;
}

const Health& changed_inputs(const World& world) { return world.inputs; }

}  // namespace ls::render
