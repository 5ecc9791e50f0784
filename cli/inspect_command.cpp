#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/job_options.h"
#include "cli/local_world.h"
#include "cli/say.h"
#include "common/base/plain_text.h"
#include "worker/machine.h"

namespace ls::cli {
namespace {

using nlohmann::ordered_json;

struct Flags {
  std::string scene, frame;
  std::vector<std::string> defines;
  bool json = false, strict = false;
};

ordered_json to_json(const LocalScene& scene, const LocalWorld& built, const render::WorldReport& report) {
  const auto& job = built.job;
  ordered_json j{{"scene", scene.name},
                 {"scene_sha256", job.scene.hex()},
                 {"size", {job.settings.size.width, job.settings.size.height}},
                 {"spp", job.spp ? ordered_json(*job.spp) : ordered_json()},
                 {"integrator", job.settings.integrator},
                 {"max_depth", job.settings.max_depth},
                 {"variant", report.variant},
                 {"features_used", report.used},
                 {"features_left_out", report.left_out},
                 {"assets", ordered_json::array()},
                 {"structures", ordered_json::array()},
                 {"clamped_inputs", report.clamped_inputs},
                 {"warnings", job.warnings}};
  for (const BlobRef& asset : job.assets)
    j["assets"].push_back({{"name", asset.name}, {"bytes", asset.bytes}, {"sha256", asset.digest.hex()}});
  for (const auto& [name, bytes] : report.bytes)
    j["structures"].push_back({{"name", name}, {"bytes", bytes}});
  return j;
}

void print_list(const char* title, const std::vector<std::string>& items) {
  if (items.empty()) return;
  print(title);
  for (const std::string& item : items) print("  " + plain_text(item));
}

void print_text(const LocalScene& scene, const LocalWorld& built, const render::WorldReport& report) {
  const auto& job = built.job;
  print(fmt::format("{}: {} x {} pixels, {} samples per pixel, integrator {} ({})", plain_text(scene.name),
                    job.settings.size.width, job.settings.size.height, job.spp.value_or(0),
                    job.settings.integrator, report.variant));
  print_list("used", report.used);
  print_list("left out", report.left_out);
  if (!job.assets.empty()) print("assets");
  for (const BlobRef& asset : job.assets)
    print(fmt::format("  {}  {}", plain_text(asset.name), show_bytes(asset.bytes)));
  if (!report.bytes.empty()) print("in memory");
  for (const auto& [name, bytes] : report.bytes)
    print(fmt::format("  {}  {}", plain_text(name), show_bytes(bytes)));
  if (report.clamped_inputs > 0)
    print(fmt::format("{} inputs were clamped (negative densities and texels, degenerate triangles)",
                      report.clamped_inputs));
}

int run(const Flags& flags) {
  JobSpec spec;
  auto defines = parse_defines(flags.defines);
  if (!defines) return say_error(defines.error());
  spec.defines = std::move(*defines);
  std::optional<std::uint32_t> frame;
  if (!flags.frame.empty()) {
    const auto number = parse_whole("--frame", flags.frame, 0, kMaxFrameNumber);
    if (!number) return say_error(number.error());
    frame = static_cast<std::uint32_t>(*number);
  }
  const auto scene = read_local_scene(flags.scene, spec.defines, flags.strict, frame);
  if (!scene) return say_rejected(scene.error());
  const auto built = build_local_world(*scene, spec, worker::usable_cpus());
  if (!built) return say_rejected(built.error());
  for (const std::string& warning : built->job.warnings)
    fmt::print(stderr, "{}{}", warning, warning.ends_with('\n') ? "" : "\n");
  const render::WorldReport report = render::describe(*built->world);
  if (flags.json)
    print(to_json(*scene, *built, report).dump(2, ' ', false, ordered_json::error_handler_t::replace));
  else
    print_text(*scene, *built, report);
  return kOk;
}

}  // namespace

void add_inspect(CLI::App& app, Action& action) {
  auto flags = std::make_shared<Flags>();
  CLI::App* inspect =
      app.add_subcommand("inspect", "read and check a scene without rendering; say what it needs");
  inspect->add_option("scene", flags->scene, "Mitsuba XML")->required()->type_name("SCENE");
  inspect->add_option("-D,--define", flags->defines, "sets the scene's $name")
      ->allow_extra_args(false)
      ->type_name("name=value");
  inspect->add_option("--frame", flags->frame, "of a sequence: this frame")->type_name("N");
  inspect->add_flag("--strict", flags->strict, "warnings are errors");
  inspect->add_flag("--json", flags->json, "as JSON");
  inspect->callback([flags, &action] { action = [flags] { return run(*flags); }; });
}

}  // namespace ls::cli
