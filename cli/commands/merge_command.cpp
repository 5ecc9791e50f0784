#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/commands/commands.h"
#include "cli/local/local_scene.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "coordinator/admission/layer_names.h"
#include "coordinator/store/files.h"
#include "core/image/exr/final_image.h"
#include "core/image/film/merge.h"
#include "core/scene/analysis/camera_view.h"
#include "core/scene/analysis/light_groups.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/json/serialize.h"
#include "util/protocol/limits.h"

namespace ls::cli {
namespace {

namespace fs = std::filesystem;

struct MergeFlags {
  std::vector<std::string> partials, defines;
  std::string out, report, scene, view;
  SceneChanges changes;
  std::optional<std::uint32_t> frame;
  JobOptions image;
};

// Returns the given files and, for each given folder, all EXR files in it, sorted by name. (A folder may hold
// more files than a command line can name.)
Result<std::vector<fs::path>> files_of(const std::vector<std::string>& arguments) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const std::string& argument : arguments) {
    if (!fs::is_directory(argument, error)) {
      files.emplace_back(argument);
      continue;
    }
    const auto before = static_cast<std::ptrdiff_t>(files.size());
    for (fs::directory_iterator entry(argument, error), end; !error && entry != end; entry.increment(error))
      if (entry->path().extension() == ".exr") files.push_back(entry->path());
    if (error) return bad_argument(fmt::format("{}: {}", argument, error.message()));
    std::sort(files.begin() + before, files.end());
  }
  if (files.empty()) return bad_argument("the given folders contain no .exr file");
  return files;
}

// Null: few bright pixels carry the error.
nlohmann::ordered_json rmse_interval(const ImageError& error) {
  if (error.rmse > 0 && error.rmse_hi == 0) return nullptr;
  return {error.rmse_lo, error.rmse_hi};
}

Result<void> write_report(const MergeFlags& flags, const Merged& merged, const std::string& digest,
                          std::uint64_t clamped) {
  const FrameSize size = merged.film.grid().frame;
  const ImageError error = image_error(merged.film.error());
  const nlohmann::ordered_json j{{"pixels_sha256", digest},
                                 {"size", {size.width, size.height}},
                                 {"spp", error.spp},
                                 {"samples", merged.film.samples()},
                                 {"rmse", error.rmse},
                                 {"rmse_ci95", rmse_interval(error)},
                                 {"relmse", error.relmse},
                                 {"relmse_ci95", {error.relmse_lo, error.relmse_hi}},
                                 {"trusted", error.trusted},
                                 {"verdict", error.verdict},
                                 {"few_hits_pixels", error.few_hits},
                                 {"pixels_without_samples", merged.film.pixels_without_samples()},
                                 {"scene", merged.scene.hex()},
                                 {"settings", merged.settings.hex()},
                                 {"numeric_class", merged.numeric_class.hex()},
                                 {"duplicates", merged.duplicates},
                                 {"clamped_values", clamped}};
  return save_result(flags.report, j.dump(2) + "\n");
}

// True if `digest` is that of the scene as a job renders it: pruned, that is, reduced to what the job's
// integrator can see. Partials (files with pixel sums) do not name the integrator, so all possible ones are
// tried.
bool is_of(const Scene& scene, const Digest& digest) {
  const std::string own = scene.integrator.name;
  return std::ranges::any_of(
      std::array<std::string, 3>{own, "path", "volpath"}, [&](const std::string& name) {
        return digest_of(scene::pruned(scene, scene::pruned_for(name, scene.integrator.max_depth)).scene) ==
               digest;
      });
}

// Reads the scene of the partials, for what they do not contain: the names of identifiers and light groups,
// and the camera.
tl::expected<Scene, coordinator::Rejected> scene_of(const MergeFlags& flags, const Merged& merged) {
  const auto defines = parse_defines(flags.defines);
  if (!defines) return coordinator::rejected(defines.error());
  auto scene = read_local_scene(flags.scene, *defines, false, flags.frame,
                                merged.film.aovs().any_of(aovs_of(AovKind::ids)));
  if (!scene) return tl::unexpected(scene.error());
  if (const auto ok = change_scene(flags.changes, scene->scene); !ok)
    return coordinator::rejected(ok.error());
  if (!is_of(scene->scene, merged.scene))
    return coordinator::rejected(
        {Errc::invalid_argument,
         fmt::format("the partial images were rendered from scene {}, and {} is another scene: give the same "
                     "scene file, with the same -D, --techniques, --mix and --frame",
                     merged.scene.hex(), flags.scene)});
  return std::move(scene->scene);
}

int run(const MergeFlags& flags) {
  if (const auto ok = check_outputs("-o", flags.out, std::nullopt); !ok) return print_error(ok.error());
  if (image_format(flags.out) == ImageFormat::json)
    return usage_error(fmt::format("-o {}: partials become an image, .exr or .png", flags.out));
  if (!flags.report.empty())
    if (const auto ok = check_output("--report", flags.report); !ok) return print_error(ok.error());
  const auto views = views_for(flags.view, flags.out);
  if (!views) return print_error(views.error());
  const auto spec = flags.image.parse();
  if (!spec) return print_error(spec.error());
  const auto files = files_of(flags.partials);
  if (!files) return print_error(files.error());
  std::vector<PartialSource> sources;
  for (const fs::path& file : *files)
    sources.push_back(
        {file.string(), [file] { return coordinator::read_file(file, limits::kMessageBytes); }});
  const auto merged = merge_partials(sources);
  if (!merged) return print_error(merged.error());
  Provenance provenance;
  provenance.scene = merged->scene;
  // The settings themselves are unknown: partials contain only their digest.
  provenance.settings_json = nlohmann::json{{"sha256", merged->settings.hex()}}.dump();
  provenance.build = LIGHTSHAFT_VERSION;
  provenance.numeric_class = merged->numeric_class;
  if (!flags.scene.empty()) {
    const auto scene = scene_of(flags, *merged);
    if (!scene) return print_rejected(scene.error());
    const AovSet aovs = merged->film.aovs();
    provenance.names = coordinator::layer_names_of(
        *scene, aovs, aovs.groups() > 0 ? scene::light_groups_of(*scene) : std::vector<std::string>());
    provenance.camera = scene::camera_matrices(scene->sensor, scene->film, merged->film.grid().frame);
  }
  const auto image = final_exr(merged->film, provenance, form_of(*spec));
  if (!image) return print_error(image.error());
  const bool png = image_format(flags.out) == ImageFormat::png;
  ToCodes to_codes = srgb_codes;
  if (*views)
    to_codes = [view = (*views)->view(flags.view).value()](std::span<const double> rgb) {
      return view.codes(rgb);
    };
  const auto shown = png ? preview_png(merged->film, 0, {}, to_codes) : Result<std::vector<std::byte>>();
  if (!shown) return print_error(shown.error());
  if (const auto saved = save_result(flags.out, png ? *shown : image->exr); !saved)
    return print_error(saved.error());
  if (merged->film.aovs().deep().count > 0) {
    const auto deep = deep_exr_of(merged->film, provenance, form_of(*spec));
    if (!deep) return print_error(deep.error());
    if (const auto saved = save_result(deep_file(flags.out), *deep); !saved)
      return print_error(saved.error());
  }
  const std::string digest = pixels_sha256(merged->film).hex();
  if (!flags.report.empty())
    if (const auto written = write_report(flags, *merged, digest, image->clamped); !written)
      return print_error(written.error());
  print("pixels_sha256 " + digest);
  return kOk;
}

}  // namespace

void add_merge(CLI::App& app, Action& action) {
  const auto [merge, flags] = add_command<MergeFlags>(
      app, action, "merge", "combine partial images into the final one, exactly as the coordinator does",
      run);
  add_option(*merge, "partials", flags->partials, "PARTIAL.exr...", "partial images, or folders of them")
      ->required();
  add_option(*merge, "-o,--output", flags->out, "OUT.exr", "the image, .exr or .png")->required();
  add_view(*merge, flags->view);
  add_option(*merge, "--report", flags->report, "REPORT.json", "write the digest and the error as JSON");
  add_option(*merge, "--scene", flags->scene, "SCENE",
             "the scene that was rendered; names of cryptomattes and the camera come from it");
  add_defines(*merge, flags->defines);
  add_scene_changes(*merge, flags->changes);
  add_option(*merge, "--frame", flags->frame, "N", "for a sequence: only this frame");
  flags->image.add_to(*merge, JobOptions::Command::merge);
}

}  // namespace ls::cli
