#include "worker/render/render.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "worker/render/integrator/aov_pixel.h"
#include "worker/render/integrator/light_paths.h"
#include "worker/render/integrator/variant.h"
#include "worker/render/math/math.h"
#include "worker/render/math/processor.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

// The variants of the integrators `volpath` and `path` that have none of the features `aimed`, `connected`
// and `reuse` (Features). Variants with these features have lists of their own (variant.h).
std::span<const Variant> plain_variants() {
  static const Variant kVariants[] = {
      variant<Features{}>("surfaces"),
      variant<Features{.passing = true}>("surfaces that light passes"),
      variant<Features{.media = true, .passing = true}>("homogeneous grey media"),
      variant<Features{.media = true, .chromatic = true, .passing = true}>("homogeneous chromatic media"),
      variant<Features{.media = true, .grids = true, .passing = true}>("grey grids"),
      variant<Features{.media = true, .grids = true, .chromatic = true, .passing = true}>("chromatic grids"),
      variant<kEveryScene>("everything"),
      variant<kEveryScene.with(&Features::phases)>("everything, any phase function"),
      variant<Features{.media = true, .passing = true, .height = true}>("grey fog that falls with height"),
      variant<kAnyMedia>("everything, fog that falls with height"),
      variant<Features{.passing = true, .motion = true}>("surfaces that move"),
      variant<Features{.media = true, .passing = true, .motion = true}>(
          "homogeneous grey media, surfaces that move"),
      variant<kAnyMotion>("everything, surfaces that move"),
      kSplitVariant,
  };
  return kVariants;
}

std::span<const Variant> variants_for(const World& w) {
  if (w.need.connected) return connected_variants();
  if (w.need.aimed) return aimed_variants();
  if (w.need.reuse) return reuse_variants();
  if (w.need.whitted) return whitted_variants();
  return w.distant_mis ? distant_variants() : plain_variants();
}
const Variant& choose(const World& w) {
  const auto all = variants_for(w);
  const auto first = std::ranges::find_if(all, [&](const Variant& v) { return v.covers.covers(w.need); });
  return first == all.end() ? all.back() : *first;
}

// The largest usable radiance: 2^31 samples of it can be summed in float32. A larger sample is an error of
// the scene: adding it could make the sums of a whole unit infinite, and rendering the unit again would not
// help. NaN fails the test too. The limit applies to single samples, so that rejection does not depend on how
// samples are grouped.
constexpr float kLargestRadiance = 0x1p96f;
bool usable(const SampleOutcome& s) {
  const C3& c = s.radiance;
  return std::abs(c.x) <= kLargestRadiance && std::abs(c.y) <= kLargestRadiance &&
         std::abs(c.z) <= kLargestRadiance && s.cut_off == HealthCause::none;
}
// True for nearly every sample: it is usable and needs no counting. Floats from 0 up to the limit have the
// same order as their bit patterns; negative floats and NaN have larger patterns.
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

// Renders the samples `range` of pixels with a variant, one by one, and keeps data that consecutive samples
// have in common.
class Samples {
 public:
  Samples(const World& w, const Variant& v, SampleRange range, Breadcrumb* crumb = nullptr)
      : w_(w), v_(v), range_(range), crumb_(crumb) {}
  // Renders sample number `sample` of the pixel (x, y). `split` receives the sample's light components; it
  // may be null if the variant computes none.
  SampleOutcome of(int x, int y, std::uint64_t sample, LightSplit* split) {
    if (v_.group) return shared(x, y, sample, split);
    if (crumb_) mark({x, y}, sample);
    return v_.sample(w_, x, y, sample, split, connections(sample));
  }

 private:
  void mark(PixelAt p, std::uint64_t sample) {
    crumb_->x.store(p.x, std::memory_order_relaxed);
    crumb_->y.store(p.y, std::memory_order_relaxed);
    crumb_->sample.store(sample, std::memory_order_relaxed);
  }
  Connections connections(std::uint64_t sample) {
    if (!w_.need.connected) return {};
    const std::uint64_t set = LightVertexCache::set_of(sample),
                        first = LightVertexCache::set_of(range_.s0 & ~1ull);
    if (set - first >= sets_.size()) sets_.resize(set - first + 1);
    auto& vertices = sets_[set - first];
    if (!vertices)
      vertices = w_.light_vertices.get(set, [&](std::uint64_t s) { return trace_light_vertices(w_, s); });
    return {.vertices = vertices.get()};
  }

  SampleOutcome shared(int x, int y, std::uint64_t sample, LightSplit* split) {
    const SharingBlock block(w_, {x, y});
    if (block.row() != row_) blocks_.clear();
    row_ = block.row();
    auto [it, is_new] = blocks_.try_emplace(block.column());
    Rendered& r = it->second;
    if (is_new) render(block, r);
    const std::size_t i = (sample - range_.s0) * block.pixels() + block.index({x, y});
    if (split && v_.covers.split) *split = r.splits[i];
    return r.outcomes[i];
  }

  struct Rendered {
    std::vector<SampleOutcome> outcomes;  // index: (sample - range_.s0) * block.pixels() + block.index(pixel)
    std::vector<LightSplit> splits;
  };
  void render(const SharingBlock& block, Rendered& r) {
    r.outcomes.resize((range_.s1 - range_.s0) * block.pixels());
    if (v_.covers.split) r.splits.resize(r.outcomes.size());
    for (std::uint64_t s = range_.s0; s < range_.s1; ++s) {
      const std::size_t begin = (s - range_.s0) * block.pixels();
      const SharingBlock::Pixels pixels = block.in_order_of(s);
      if (crumb_) mark(pixels.front(), s);
      std::array<SampleOutcome, kMostTogether> outcomes;
      LightSplit black;
      black.clear(w_.aovs.groups());
      black.by_depth.wanted = w_.aovs.deep().count > 0;
      std::vector<LightSplit> splits(v_.covers.split ? pixels.size() : 0, black);
      v_.group(w_, pixels, s, splits, outcomes);
      for (std::size_t k = 0; k < pixels.size(); ++k) {
        const std::size_t i = begin + block.index(pixels[k]);
        r.outcomes[i] = outcomes[k];
        if (v_.covers.split) r.splits[i] = splits[k];
      }
    }
  }

  const World& w_;
  const Variant& v_;
  SampleRange range_;
  Breadcrumb* crumb_;
  // The sets of light vertices of all samples of `range_`. They are held to the end, since every pixel needs
  // all of them, while LightVertexCache keeps only those used last.
  std::vector<std::shared_ptr<const LightVertices>> sets_;
  // With Features::reuse: the rendered blocks (SharingBlock) of the row of blocks `row_`; the key is the
  // block's column
  int row_ = -1;
  std::map<int, Rendered> blocks_;
};

struct PixelSums {
  double half[2][3] = {};
};

// Multiplies the colours of a tile by the weights of its meters, within the range of float32, as the film has
// no infinities.
[[gnu::cold, gnu::noinline]] void weigh(const Meters& meters, PixelRect tile, std::vector<float>& sums) {
  constexpr double kMost = std::numeric_limits<float>::max();
  const auto pixels = static_cast<std::size_t>(tile.pixels());
  std::size_t i = 0;
  for (int y = tile.y0; y < tile.y1; ++y)
    for (int x = tile.x0; x < tile.x1; ++x, ++i) {
      const double weight = meters.at(x, y).weight;
      for (std::size_t plane = 0; plane < 6; ++plane) {
        float& sum = sums[plane * pixels + i];
        sum = rounded(std::clamp(sum * weight, -kMost, kMost));
      }
    }
}

// The sums of a pixel besides its colour: none (NoAovs), or AOVs (AovPixel).
struct NoAovs {
  static LightSplit* split() { return nullptr; }
  static void begin_pixel(int, int) {}
  static void begin_sample() {}
  static void end_sample(int, int, std::uint64_t, bool) {}
  static void store(float*, std::size_t, std::size_t) {}
};

template <class Aovs>
PixelSums render_pixel(Samples& samples, int x, int y, SampleRange range, Health& health, Aovs& aovs) {
  PixelSums sums;
  for (std::uint64_t s = range.s0; s < range.s1; ++s) {
    aovs.begin_sample();
    const SampleOutcome out = samples.of(x, y, s, aovs.split());
    aovs.end_sample(x, y, s, usable(out));
    // A sample that is not usable is counted in `health` and contributes zero to the pixel. No other sample
    // replaces it, and it still counts in the number of samples by which the pixel's sum is divided.
    if (!clean(out)) [[unlikely]] {
      count(out, {x, y, s}, health);
      if (!usable(out)) continue;
    }
    for (int c = 0; c < 3; ++c) sums.half[s & 1][c] += static_cast<double>(out.radiance[c]);
  }
  return sums;
}

template <class Aovs>
TileResult render_tile_with(const World& w, const Variant& v, PixelRect tile, SampleRange range,
                            const std::atomic<bool>* stop, Breadcrumb* crumb, Aovs aovs) {
  const FlushDenormals mode;
  Samples samples(w, v, range, crumb);
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
      aovs.begin_pixel(x, y);
      const PixelSums sums = render_pixel(samples, x, y, range, r.health, aovs);
      aovs.store(r.sums.data() + 6 * pixels, pixels, i);
      for (std::size_t h = 0; h < 2; ++h)
        for (std::size_t c = 0; c < 3; ++c) r.sums[(3 * h + c) * pixels + i] = rounded(sums.half[h][c]);
    }
  }
  if (w.meters.any()) weigh(w.meters, tile, r.sums);
  return r;
}
TileResult render_tile_with(const World& w, const Variant& v, PixelRect tile, SampleRange range,
                            const std::atomic<bool>* stop, Breadcrumb* crumb) {
  // A variant that splits light into components needs somewhere to put them, even if no AOV asks for them.
  if (w.aovs.empty() && !v.covers.split) return render_tile_with(w, v, tile, range, stop, crumb, NoAovs{});
  return render_tile_with(w, v, tile, range, stop, crumb, AovPixel(w));
}

}  // namespace

TileResult render_tile(const World& world, PixelRect tile, SampleRange samples, const std::atomic<bool>* stop,
                       Breadcrumb* breadcrumb) {
  return render_tile_with(world, choose(world), tile, samples, stop, breadcrumb);
}

int tile_alignment(const World& world) { return world.need.reuse ? SharingBlock::kSide : 1; }

std::vector<std::string> all_variants(const World& world) {
  std::vector<std::string> names;
  for (const Variant& v : variants_for(world)) names.emplace_back(v.name);
  return names;
}

std::vector<std::string> covering_variants(const World& world) {
  std::vector<std::string> names;
  for (const Variant& v : variants_for(world)) {
    if (v.covers.split || v.covers.covers(world.need)) names.emplace_back(v.name);
  }
  return names;
}

TileResult render_tile_as(const World& world, const std::string& name, PixelRect tile, SampleRange samples) {
  for (const Variant& v : variants_for(world)) {
    if (name != v.name) continue;
    return render_tile_with(world, v, tile, samples, nullptr, nullptr);
  }
  return {};
}

SampleValue render_sample(const World& world, int x, int y, std::uint64_t sample) {
  const FlushDenormals mode;
  LightSplit split;
  split.clear(world.aovs.groups());
  const SampleOutcome out = Samples(world, choose(world), {sample, sample + 1}).of(x, y, sample, &split);
  SampleValue value{{out.radiance.x, out.radiance.y, out.radiance.z}, usable(out), {}};
  count(out, {x, y, sample}, value.health);
  return value;
}

double sample_weight(const World& world, int x, int y) {
  return world.meters.any() ? world.meters.at(x, y).weight : 1;
}

const Health& changed_inputs(const World& world) { return world.inputs; }

}  // namespace ls::render
