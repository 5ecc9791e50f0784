#include "cli/cases/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "cli/validate_measure.h"

namespace ls::cases {

namespace {
constexpr std::uint64_t kMostBrokenSpp = 64;  // of a broken renderer's frames: no more show that it is broken
}

double Picture::mean(std::size_t pixel, std::size_t channel) const {
  const std::size_t count = sums.size() / 6;
  return (double{sums[channel * count + pixel]} + double{sums[(3 + channel) * count + pixel]}) /
         static_cast<double>(spp);
}

Result<Picture> shoot(const SceneKit& kit, std::uint64_t spp, const Bench& bench) {
  const auto scene = cli::as_sent(kit.scene);
  if (!scene) return tl::unexpected(scene.error());
  const RenderSettings settings = cli::settings_of(*scene, bench.seed);
  const auto world = render::build_world(*scene, settings, kit.files, bench.threads);
  if (!world) return tl::unexpected(world.error());
  if (bench.gain != 1) spp = std::min(spp, kMostBrokenSpp);
  render::TileResult frame = cli::render_frame(**world, settings.size, {0, spp}, bench.threads);
  if (bench.gain != 1)
    for (float& sum : frame.sums) sum *= static_cast<float>(bench.gain);
  return Picture{settings.size, spp, std::move(frame.sums), frame.health,
                 render::describe(**world).clamped_inputs};
}

std::optional<std::string> what_is_lost(const std::string& id, const SceneKit& kit) {
  const bool grid = id.find("/grid") != std::string::npos;
  if (!grid && id.find("/homogeneous") == std::string::npos) return std::nullopt;
  const auto sent = cli::as_sent(kit.scene);
  if (!sent) return sent.error().message;
  const bool left = std::any_of(sent->media.begin(), sent->media.end(), [&](const Medium& m) {
    return std::holds_alternative<HeterogeneousMedium>(m) == grid;
  });
  if (left) return std::nullopt;
  return fmt::format("no {} medium is left of the scene that is sent: the case asks nothing of media",
                     grid ? "grid" : "homogeneous");
}

Figure every_value(const Bench& bench, const SceneKit& kit, std::uint64_t spp, const Channels& expected,
                   double tolerance) {
  if (const auto lost = what_is_lost(bench.id, kit)) return {.why = *lost};
  const auto p = shoot(kit, spp, bench);
  if (!p) return {.why = p.error().message};
  Figure f{expected[0], expected[0], tolerance * (expected[0] != 0 ? std::abs(expected[0]) : 1), {}, 0};
  f.unhealthy = cli::samples_gone_wrong(p->health);
  double farthest = -1;
  for (std::size_t i = 0; i < p->sums.size() / 6; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double unit = expected[c] != 0 ? std::abs(expected[c]) : 1;
      const double off = std::abs(p->mean(i, c) - expected[c]) / unit;
      if (off <= farthest) continue;
      farthest = off;
      f = {expected[c], p->mean(i, c), tolerance * unit, {}, f.unhealthy};
    }
  }
  return f;
}

Figure same_bits(const Bench& bench, const SceneKit& a, const SceneKit& b, std::uint64_t spp) {
  if (const auto lost = what_is_lost(bench.id, a)) return {.why = *lost};
  if (const auto lost = what_is_lost(bench.id, b)) return {.why = *lost};
  const auto p = shoot(a, spp, bench), q = shoot(b, spp, bench);
  if (!p) return {.why = p.error().message};
  if (!q) return {.why = q.error().message};
  if (p->sums.size() != q->sums.size()) return {.why = "the frames are not of one size"};
  Figure f;
  f.unhealthy = cli::samples_gone_wrong(p->health) + cli::samples_gone_wrong(q->health);
  bool any = false;
  for (std::size_t i = 0; i < p->sums.size(); ++i) {
    f.got += p->sums[i] == q->sums[i] ? 0 : 1;
    any = any || p->sums[i] != 0;
  }
  if (!any) f.why = "both frames are black: nothing was compared";
  return f;
}

Figure refused(const Bench& bench, const SceneKit& kit, const std::vector<std::string>& words) {
  const auto world =
      render::build_world(kit.scene, cli::settings_of(kit.scene, bench.seed), kit.files, bench.threads);
  Figure f{.expected = 1};
  if (world) {
    f.why = "the scene was accepted";
    return f;
  }
  f.got = 1;
  for (const std::string& word : words)
    if (world.error().message.find(word) == std::string::npos)
      f.why = fmt::format("refused without saying '{}': {}", word, world.error().message);
  return f;
}

}  // namespace ls::cases
