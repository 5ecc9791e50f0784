// The path tracers with Features::reuse (pixels share the tails of their paths: path_reuse.h), and the
// decision which worlds use them.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/image/error/relative_weights.h"
#include "worker/render/base/in_order.h"
#include "worker/render/integrator/light_paths.h"
#include "worker/render/integrator/variant.h"
#include "worker/render/math/processor.h"
#include "worker/render/render.h"
#include "worker/render/world/pilot.h"

namespace ls::render {
namespace {

constexpr std::size_t kSharing = kUsualPathReuse;

// A pilot renders some groups of pixels to find out whether sharing pays. It takes kPilotSamples samples per
// pixel, as many as a quick image has. With fewer samples, a larger part of the noise would come from edges
// and soft shadows, which sharing does not reduce.
constexpr std::uint64_t kSharingPilotSeed = 0x5eed0f9a7e;
constexpr std::uint64_t kPilotGroups = 64;  // the largest number of groups
constexpr std::uint64_t kFewestPilotGroups = 4;
// One group is rendered for this many pixels of the frame, so that the pilot takes about as long as one
// sample of each pixel.
constexpr std::uint64_t kPixelsPerGroup = 1024;
constexpr std::uint64_t kPilotSamples = 32;
// Largest number of segments of a pilot's path. Without a limit, a path in a dense medium that absorbs
// nothing could have thousands.
constexpr int kPilotDepth = 32;
// Sharing pays if the noise (squared relative error) without it is more than this many times the noise with
// it. With sharing a sample takes 1.4 to 2.4 times as long as without it (docs/decisions/0036-path-reuse.md).
// The limit is near the lower end of this range, because the few pixels of the pilot rarely show the rare
// bright paths that sharing helps most.
constexpr double kGainThatPays = 1.5;
// If the gain after some of the groups is this many times kGainThatPays, the other groups are not rendered.
constexpr double kBeyondDoubt = 4;

class Pilot {
 public:
  explicit Pilot(World& w) : w_(w), settings_(w, kSharingPilotSeed, kPilotDepth) { w.reuse = kSharing; }
  Pilot(const Pilot&) = delete;
  Pilot& operator=(const Pilot&) = delete;
  ~Pilot() { w_.reuse = 0; }

  // Sums of squared relative errors of the same pixels, rendered with shared paths (`shared`) and without
  // (`alone`). `usable` is false if a sample was rejected; the sums are then meaningless.
  struct Noise {
    double shared = 0, alone = 0;
    bool usable = true;
    // True if there is more than `factor` times as much noise without sharing as with it.
    bool gains(double factor) const { return alone > factor * shared; }
  };
  // Renders one group of the pixels of a square that is chosen at random, with shared paths and without.
  // `number` is the number of the group, and also the sample number that determines how the square is divided
  // into groups.
  Noise of_group(const Variant& sharing, std::uint64_t number) const {
    const FlushDenormals mode;
    RandomStream places(combine(kSharingPilotSeed, number));
    const auto among = [&](int n) { return static_cast<int>(places.next() % static_cast<std::uint64_t>(n)); };
    const PixelAt somewhere{among(w_.frame.width) - w_.origin_x, among(w_.frame.height) - w_.origin_y};
    SharingBlock::Pixels group = SharingBlock(w_, somewhere).in_order_of(number);
    if (group.size() > kSharing) group.resize(kSharing);
    std::array<Halves, kSharing> shared, alone;
    shared.fill({V3d(0), V3d(0)});
    alone = shared;
    for (std::uint64_t n = 0; n < kPilotSamples; ++n) {
      std::array<SampleOutcome, kSharing> outcomes;
      sharing.group(w_, group, n, {}, outcomes);
      for (std::size_t k = 0; k < group.size(); ++k) {
        const SampleValue v = render_sample(w_, group[k].x, group[k].y, n);
        if (!v.finite || outcomes[k].cut_off != HealthCause::none || !is_finite(outcomes[k].radiance))
          return {.usable = false};
        shared[k][n % 2] += V3d(outcomes[k].radiance);
        alone[k][n % 2] += V3d(v.rgb[0], v.rgb[1], v.rgb[2]);
      }
    }
    Noise noise;
    for (std::size_t k = 0; k < group.size(); ++k)
      for (int c = 0; c < 3; ++c) {
        // Errors are relative to the mean of all samples, shared and not shared. So a rare bright sample of
        // one kind reduces the relative errors of both kinds.
        const double mean =
            (shared[k][0][c] + shared[k][1][c] + alone[k][0][c] + alone[k][1][c]) / (2 * kPilotSamples);
        const double weight = 1 / (mean * mean + kRelMseDenominator);
        const auto squared = [](double x) { return x * x; };
        noise.shared += squared(shared[k][0][c] - shared[k][1][c]) * weight;
        noise.alone += squared(alone[k][0][c] - alone[k][1][c]) * weight;
      }
    return noise;
  }

 private:
  // Sums of a pixel's samples: [0] of those with even numbers, [1] of the others
  using Halves = std::array<V3d, 2>;

  World& w_;
  const PilotSettings settings_;
};

bool sharing_pays(World& w, const Variant& sharing, int threads) {
  if (!pilot_pays(w)) return false;
  const auto pixels = static_cast<std::uint64_t>(w.frame.width) * static_cast<std::uint64_t>(w.frame.height);
  const std::uint64_t groups = std::clamp(pixels / kPixelsPerGroup, kFewestPilotGroups, kPilotGroups);
  const Pilot pilot(w);
  Pilot::Noise all;
  in_order(
      threads, groups, [&](std::size_t i) { return pilot.of_group(sharing, i); },
      [&, taken = std::uint64_t{0}](const Pilot::Noise& group) mutable {
        all.usable = group.usable;
        all.shared += group.shared;
        all.alone += group.alone;
        return all.usable && (++taken < kFewestPilotGroups || !all.gains(kBeyondDoubt * kGainThatPays));
      });
  return all.usable && all.gains(kGainThatPays);
}

}  // namespace

std::span<const Variant> reuse_variants() {
  static constexpr Features kAll{.media = true, .chromatic = true, .passing = true, .reuse = true};
  static constexpr Variant kVariants[] = {
      group_variant<Features{.passing = true, .reuse = true}>("surfaces, tails shared"),
      group_variant<Features{.media = true, .passing = true, .reuse = true}>(
          "homogeneous grey media, tails shared"),
      group_variant<kAll>("homogeneous chromatic media, tails shared"),
      group_variant<kAll.with(&Features::phases)>("homogeneous media, tails shared, any phase function"),
      group_variant<kAll.with(&Features::phases).with(&Features::split)>(
          "homogeneous media, tails shared, and light in parts"),
  };
  return kVariants;
}

void share_tails(const IntegratorSettings& settings, int threads, World& w) {
  Features need = w.need;
  need.split = false;
  need.reuse = true;
  // Paths are not shared in scenes with grids, where the density of flights has no closed form, nor in scenes
  // with lamps (lights without extent) in media, with light vertices or with points on camera segments
  // (segment_nee.h), because these change how directions are sampled.
  const auto variants = reuse_variants();
  const auto sharing =
      std::ranges::find_if(variants, [&](const Variant& v) { return v.covers.covers(need); });
  if (settings.path_reuse < 0 || settings.path_reuse == 1 || sharing == variants.end()) return;
  // A tail keeps only one density (SharedTail::hit_pdf) with which next-event estimation finds the light that
  // the tail's ray hits. A ray that leaves the scene may hit several lights: the sky and suns with an extent.
  // So paths are shared only if next-event estimation samples at most one of these.
  if (!w.lights.single_environment_sample() || !w.depth_allows(2)) return;
  // Paths are not shared if Russian roulette may end them at the first vertex: the densities of second
  // vertices would have to contain the probability of survival
  if (w.rr_depth < 2) return;
  for (const SurfaceInfo& s : w.geometry.surfaces)
    // Paths are not shared if a medium has an open boundary, behind which rays from different sides may find
    // different media; nor if rays pass straight through surfaces that emit light, since a tail's ray may
    // then hit several of them, but a tail keeps the light of only one.
    if ((s.transition && s.sheet) || ((s.null || s.null_transmission) && s.light != kNone)) return;
  const bool automatic = settings.path_reuse == 0;
  // A denoiser takes means over neighbouring pixels itself, and takes noise that they share for detail of the
  // picture. Its image is as good without sharing, in less time (docs/measurements/path-reuse.md).
  w.reuse_left_to_denoiser = automatic && w.aovs.any_of(aovs_of(AovKind::guide));
  if (w.reuse_left_to_denoiser || (automatic && !sharing_pays(w, *sharing, threads))) return;
  w.reuse = automatic ? kUsualPathReuse : settings.path_reuse;
  w.need.reuse = true;
}

}  // namespace ls::render
