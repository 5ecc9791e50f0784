#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "cli/commands/commands.h"
#include "cli/local/local_render.h"
#include "cli/local/local_scene.h"
#include "cli/local/local_world.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "util/protocol/limits.h"
#include "worker/child/child.h"
#include "worker/machine.h"

namespace ls::cli {
namespace {

struct RenderFlags {
  std::string scene, out, view, threads, pixel, sample, reference, report, html, partial_dir;
  JobOptions job;
  bool isolate = false, quiet = false, progress = false;
};

std::optional<std::filesystem::path> path_of(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional<std::filesystem::path>(text);
}

Result<LocalRenderOptions> options_of(const RenderFlags& flags) {
  LocalRenderOptions options;
  auto spec = flags.job.parse();
  if (!spec) return tl::unexpected(spec.error());
  options.spec = std::move(*spec);
  const int most = flags.isolate ? worker::kMostChildThreads : limits::kThreads;
  auto threads = static_cast<std::uint64_t>(std::min(worker::usable_cpus(), most));
  if (const auto ok = take(flags.threads, threads, whole("--threads", 1, static_cast<std::uint64_t>(most)));
      !ok)
    return tl::unexpected(ok.error());
  options.threads = static_cast<int>(threads);
  options.isolate = flags.isolate;
  options.quiet = flags.quiet;
  options.progress = flags.quiet      ? ProgressForm::none
                     : flags.progress ? ProgressForm::lines
                                      : ProgressForm::bar;
  options.strict = flags.job.strict;
  const char* ending = options.spec.frames ? "_####.exr" : ".exr";
  options.out = flags.out.empty() ? std::filesystem::path(flags.scene).stem().string() + ending : flags.out;
  options.out_by_default = flags.out.empty();
  options.report = path_of(flags.report);
  options.html = path_of(flags.html);
  options.partial_dir = path_of(flags.partial_dir);
  options.reference = path_of(flags.reference);
  options.view = flags.view;
  auto views = views_for(flags.view, flags.out);
  if (!views) return tl::unexpected(views.error());
  options.views = std::move(*views);
  return options;
}

// Renders one sample of one pixel again, for debugging, and prints its value; returns the exit code.
int replay_sample(const LocalScene& scene, const JobSpec& spec, int threads, std::pair<int, int> pixel,
                  std::uint64_t sample) {
  const auto built = build_local_world(scene, spec, threads);
  if (!built) return print_rejected(built.error());
  const auto [x, y] = pixel;
  const FrameSize size = built->job.settings.size;
  if (x >= size.width || y >= size.height)
    return usage_error(
        fmt::format("--pixel {},{} is outside of the image: it has {} x {} pixels, counted from 0", x, y,
                    size.width, size.height));
  const render::SampleValue value = render::render_sample(*built->world, x, y, sample);
  const double weight = render::sample_weight(*built->world, x, y);
  print(fmt::format("pixel {},{} sample {}: {:.9g} {:.9g} {:.9g}", x, y, sample, weight * value.rgb[0],
                    weight * value.rgb[1], weight * value.rgb[2]));
  for (const auto& [cause, entry] : value.health.causes) print(sentence(cause, entry.count));
  return kOk;
}

int replay(const RenderFlags& flags, const LocalScene& scene, const LocalRenderOptions& options) {
  if (flags.pixel.empty() || flags.sample.empty())
    return usage_error("--pixel and --sample need each other: together they name one sample of one pixel");
  const auto pixel = parse_pixel(flags.pixel);
  if (!pixel) return print_error(pixel.error());
  const auto sample = parse_whole("--sample", flags.sample, 0, limits::kSampleIndex);
  if (!sample) return print_error(sample.error());
  return replay_sample(scene, options.spec, options.threads, *pixel, *sample);
}

std::filesystem::path of_frame(const std::filesystem::path& path, std::uint32_t frame) {
  return numbered(path.string(), frame);
}

LocalRenderOptions of_frame(const LocalRenderOptions& options, std::uint32_t frame) {
  LocalRenderOptions o = options;
  o.spec.frames = FrameRange{frame, frame, 1};
  o.out = of_frame(options.out, frame);
  for (auto* path : {&o.report, &o.html, &o.partial_dir, &o.reference})
    if (*path) *path = of_frame(**path, frame);
  return o;
}

Result<void> check_files(const LocalRenderOptions& o) {
  const auto& frames = o.spec.frames;
  if (auto ok = check_outputs("-o", o.out.string(), frames); !ok) return ok;
  if (o.spec.deep > 0)
    if (auto ok = check_outputs("-o", deep_file(o.out).string(), frames); !ok) return ok;
  for (const auto& [option, path] : {std::pair("--report", &o.report), std::pair("--html", &o.html),
                                     std::pair("--partial-dir", &o.partial_dir)}) {
    if (!*path) continue;
    const std::string name = (*path)->string();
    if (frames)
      if (auto ok = check_numbered(option, name, *frames); !ok) return ok;
    if (path != &o.partial_dir)
      if (auto ok = check_outputs(option, name, frames); !ok) return ok;
  }
  return {};
}

// Renders the frames, with the same pixels as on a farm. `options` are the options of one image, except that
// in the last component of their paths a run of # is replaced by the frame number. Reads the scene of every
// frame before it renders the first. Returns the exit code, and stops at the first frame whose exit code is
// not 0.
int render_sequence(const std::string& path, const FrameRange& frames, const LocalRenderOptions& options) {
  auto reader = SceneReader::open(path, options.spec.defines, options.strict);
  if (!reader) return print_rejected(reader.error());
  if (const auto all = reader->read_all(frames); !all) return print_rejected(all.error());
  for (const std::uint32_t frame : frames.frames()) {
    const auto scene = reader->read(frame);
    if (!scene) return print_rejected(scene.error());
    if (!options.quiet && frames.count() > 1) print_note(fmt::format("lightshaft: frame {}", frame));
    if (const int code = render_locally(*scene, of_frame(options, frame)); code != kOk) return code;
  }
  return kOk;
}

int run(const RenderFlags& flags) {
  const auto options = options_of(flags);
  if (!options) return print_error(options.error());
  const bool one_sample = !flags.pixel.empty() || !flags.sample.empty();
  const auto& frames = options->spec.frames;
  if (!one_sample)
    if (const auto ok = check_files(*options); !ok) return print_error(ok.error());
  if (frames && !one_sample) return render_sequence(flags.scene, *frames, *options);
  if (frames && frames->count() > 1)
    return usage_error("--pixel and --sample need one frame: add it, for example --frames 7");
  const auto scene = read_local_scene(flags.scene, options->spec.defines, flags.job.strict,
                                      frames ? std::optional(frames->first) : std::nullopt);
  if (!scene) return print_rejected(scene.error());
  return one_sample ? replay(flags, *scene, *options) : render_locally(*scene, *options);
}

}  // namespace

void add_render(CLI::App& app, Action& action) {
  const auto [render, flags] =
      add_command<RenderFlags>(app, action, "render", "render a scene on this machine", run);
  render->footer(
      "Examples:\n"
      "  lightshaft render scene.xml                                   writes scene.exr\n"
      "  lightshaft render scene.xml -o a.png --spp 64 --size 640x360 --denoise\n"
      "  lightshaft render scene.xml --target-error 1e-3 --html report.html\n"
      "  lightshaft render smoke.xml --frames 1-10 -o out_####.exr\n"
      "LIGHTSHAFT_LOG=warn, info or debug shows what coordinator and worker do inside `render`.");
  add_option(*render, "scene", flags->scene, "SCENE", "Mitsuba XML, .pbrt, .gltf or .glb")->required();
  add_option(
      *render, "-o,--output", flags->out, "OUT.exr",
      "file of the image: .exr with all layers, or .png; of a scene with meters the values: .json; for a "
      "sequence with # for the frame number, for example out_####.exr; default: the scene's name with "
      ".exr or .json, in this folder");
  flags->job.add_to(*render, JobOptions::Command::render);
  add_view(*render, flags->view);
  add_option(*render, "--threads", flags->threads, "N", "default: all");
  add_option(*render, "--pixel", flags->pixel, "X,Y",
             "with --sample: print the value of one sample of this pixel");
  add_option(*render, "--sample", flags->sample, "N", "number of the sample, from 0");
  add_option(*render, "--reference", flags->reference, "REF.exr",
             "a reference image, rendered with another seed; the report then also has the true error");
  add_option(*render, "--report", flags->report, "REPORT.json", "write the report (cost and error) as JSON");
  add_option(*render, "--html", flags->html, "REPORT.html",
             "write the report as an HTML page with image, curves and maps");
  add_option(*render, "--partial-dir", flags->partial_dir, "DIR",
             "folder to keep the partial image of every unit in; `lightshaft merge` combines them");
  render->add_flag("--isolate", flags->isolate,
                   "render in a child process, so that a crash does not end this one");
  auto* quiet = render->add_flag("--quiet", flags->quiet, "print only warnings and errors");
  render
      ->add_flag("--progress", flags->progress,
                 "print progress as one line for each percent, for logs and programs")
      ->excludes(quiet);
}

}  // namespace ls::cli
