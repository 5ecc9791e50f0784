#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "cli/commands/commands.h"
#include "cli/commands/inspection.h"
#include "cli/local/instructions.h"
#include "cli/local/local_world.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "common/scene/analysis/prune.h"
#include "worker/machine.h"
#include "worker/render/base/work_counters_list.h"

namespace ls::cli {
namespace {

struct InspectFlags {
  std::string scene, frame;
  std::vector<std::string> defines;
  bool json = false, strict = false, variants = false, work = false;
};

// Longer side, in pixels, of the small image that --variants and --work render: large enough that paths hit
// all parts of a scene, and small enough to be fast.
constexpr int kSmallSide = 32;
constexpr SampleRange kSmallSamples{0, 4};

FrameSize small(FrameSize size) {
  const int longer = std::max(size.width, size.height);
  const auto scaled = [&](int x) { return longer <= kSmallSide ? x : std::max(1, x * kSmallSide / longer); };
  return {scaled(size.width), scaled(size.height)};
}

// Builds the world for a small image of the scene. If path_reuse is 0, the renderer decides by the image's
// size whether pixels share the tails of their paths. The small image uses the decision for the full size.
tl::expected<std::shared_ptr<const render::World>, coordinator::Rejected> small_world(
    LocalScene scene, const LocalWorld& whole) {
  int& path_reuse = scene.scene.integrator.path_reuse;
  const bool shared = render::techniques_of(*whole.world).has(Technique::path_reuse);
  if (path_reuse == 0) path_reuse = shared ? kUsualPathReuse : -1;
  RenderSettings settings = whole.job.settings;
  settings.size = small(settings.size);
  scene.scene = scene::pruned(scene.scene, scene::pruned_for(settings.integrator, settings.max_depth)).scene;
  return build_world_again(scene, settings, worker::usable_cpus());
}

// Renders a small image with every variant of the integrator that has the scene's features. (A variant is
// compiled for a subset of the features that scenes can have.) Returns digests of the pixel sums.
tl::expected<VariantBitsList, coordinator::Rejected> render_variants(const LocalScene& scene,
                                                                     const LocalWorld& whole) {
  const auto world = small_world(scene, whole);
  if (!world) return tl::unexpected(world.error());
  const FrameSize size = small(whole.job.settings.size);
  const PixelRect all{0, 0, size.width, size.height};
  const double paths =
      static_cast<double>(all.pixels()) * static_cast<double>(kSmallSamples.s1 - kSmallSamples.s0);
  return measure_variants(render::covering_variants(**world), paths, InstructionCounter::open(),
                          [&](const std::string& name) {
                            const auto tile = render::render_tile_as(**world, name, all, kSmallSamples);
                            return sha256(std::as_bytes(std::span(tile.sums)));
                          });
}

// Returns the work counters of rendering a small image.
tl::expected<nlohmann::ordered_json, coordinator::Rejected> count_work(
    [[maybe_unused]] const LocalScene& scene, [[maybe_unused]] const LocalWorld& whole) {
#ifdef LIGHTSHAFT_COUNT
  const auto world = small_world(scene, whole);
  if (!world) return tl::unexpected(world.error());
  const FrameSize size = small(whole.job.settings.size);
  render::work_counters() = {};
  render::render_tile(**world, {0, 0, size.width, size.height}, kSmallSamples, nullptr, nullptr);
  nlohmann::ordered_json work;
  for (const auto& [name, count] : render::listed(render::work_counters())) work[name] = count;
  return work;
#else
  return tl::unexpected(coordinator::Rejected{
      {Errc::invalid_argument, "this build does not count work: configure one with -DLIGHTSHAFT_COUNT=ON"},
      {}});
#endif
}

int run(const InspectFlags& flags) {
  JobSpec spec;
  auto defines = parse_defines(flags.defines);
  if (!defines) return print_error(defines.error());
  spec.defines = std::move(*defines);
  std::optional<std::uint32_t> frame;
  if (!flags.frame.empty()) {
    const auto number = parse_whole("--frame", flags.frame, 0, kMaxFrameNumber);
    if (!number) return print_error(number.error());
    frame = static_cast<std::uint32_t>(*number);
  }
  const auto scene = read_local_scene(flags.scene, spec.defines, flags.strict, frame);
  if (!scene) return print_rejected(scene.error());
  const auto built = build_local_world(*scene, spec, worker::usable_cpus());
  if (!built) return print_rejected(built.error());
  for (const std::string& warning : built->job.warnings)
    fmt::print(stderr, "{}{}", warning, warning.ends_with('\n') ? "" : "\n");
  VariantBitsList variants;
  if (flags.variants) {
    auto rendered = render_variants(*scene, *built);
    if (!rendered) return print_rejected(rendered.error());
    variants = std::move(*rendered);
  }
  auto report = inspection(*scene, *built, variants);
  if (flags.work) {
    const auto work = count_work(*scene, *built);
    if (!work) return print_rejected(work.error());
    report["work"] = *work;
  }
  const auto text = flags.json ? report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n"
                               : inspection_text(report);
  fmt::print("{}", text);
  return report.value("variants_agree", true) ? kOk : kFailed;
}

}  // namespace

void add_inspect(CLI::App& app, Action& action) {
  auto flags = std::make_shared<InspectFlags>();
  CLI::App* inspect =
      app.add_subcommand("inspect", "read and check a scene without rendering; say what it needs");
  inspect->add_option("scene", flags->scene, "Mitsuba XML, .pbrt, .gltf or .glb")
      ->required()
      ->type_name("SCENE");
  add_defines(*inspect, flags->defines);
  inspect->add_option("--frame", flags->frame, "of a sequence: this frame")->type_name("N");
  inspect->add_flag("--strict", flags->strict, "warnings are errors");
  inspect->add_flag("--variants", flags->variants,
                    "renders a small image with every instantiation that covers the scene: their bits must "
                    "be the same; and "
                    "counts their instructions, if this machine can");
  inspect->add_flag("--work", flags->work,
                    "counts the work of a small image (builds with LIGHTSHAFT_COUNT only)");
  inspect->add_flag("--json", flags->json, "as JSON");
  inspect->callback([flags, &action] { action = [flags] { return run(*flags); }; });
}

}  // namespace ls::cli
