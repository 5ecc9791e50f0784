#include <fmt/format.h>

#include <algorithm>

#include "cli/commands/commands.h"
#include "cli/local/local_render.h"
#include "cli/local/replay.h"
#include "cli/local/sequence_render.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "common/protocol/limits.h"
#include "worker/child/child.h"
#include "worker/machine.h"

namespace ls::cli {
namespace {

struct RenderFlags {
  std::string scene, out, threads, pixel, sample, reference, report, html, partial_dir;
  JobOptions job;
  bool isolate = false, quiet = false;
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
  options.threads = std::min(worker::usable_cpus(), most);
  if (!flags.threads.empty()) {
    const auto threads = parse_whole("--threads", flags.threads, 1, static_cast<std::uint64_t>(most));
    if (!threads) return tl::unexpected(threads.error());
    options.threads = static_cast<int>(*threads);
  }
  options.isolate = flags.isolate;
  options.quiet = flags.quiet;
  options.strict = flags.job.strict;
  const char* ending = options.spec.frames ? "_####.exr" : ".exr";
  options.out = flags.out.empty() ? std::filesystem::path(flags.scene).stem().string() + ending : flags.out;
  options.report = path_of(flags.report);
  options.html = path_of(flags.html);
  options.partial_dir = path_of(flags.partial_dir);
  options.reference = path_of(flags.reference);
  return options;
}

int replay(const RenderFlags& flags, const LocalScene& scene, const LocalRenderOptions& options) {
  if (flags.pixel.empty() || flags.sample.empty())
    return usage_error("--pixel and --sample belong together: one sample of one pixel");
  const auto pixel = parse_pixel(flags.pixel);
  if (!pixel) return print_error(pixel.error());
  const auto sample = parse_whole("--sample", flags.sample, 0, limits::kSampleIndex);
  if (!sample) return print_error(sample.error());
  return replay_sample(scene, options.spec, options.threads, *pixel, *sample);
}

int run(const RenderFlags& flags) {
  const auto options = options_of(flags);
  if (!options) return print_error(options.error());
  const bool one_sample = !flags.pixel.empty() || !flags.sample.empty();
  const auto& frames = options->spec.frames;
  if (frames && !one_sample) return render_sequence(flags.scene, *frames, *options);
  if (frames && frames->count() > 1)
    return usage_error("--pixel and --sample are of one frame: name it, --frames 7 say");
  if (!one_sample) {
    if (const auto ok = check_output("-o", options->out); !ok) return print_error(ok.error());
    if (options->report)
      if (const auto ok = check_output("--report", *options->report); !ok) return print_error(ok.error());
    if (options->html)
      if (const auto ok = check_output("--html", *options->html); !ok) return print_error(ok.error());
  }
  const auto scene = read_local_scene(flags.scene, options->spec.defines, flags.job.strict,
                                      frames ? std::optional(frames->first) : std::nullopt);
  if (!scene) return print_rejected(scene.error());
  return one_sample ? replay(flags, *scene, *options) : render_locally(*scene, *options);
}

}  // namespace

void add_render(CLI::App& app, Action& action) {
  auto flags = std::make_shared<RenderFlags>();
  CLI::App* render = app.add_subcommand("render", "render a scene on this machine");
  render->add_option("scene", flags->scene, "Mitsuba XML")->required()->type_name("SCENE");
  render
      ->add_option("-o,--output", flags->out,
                   "the image; default: the scene's name, with .exr, in this folder. Of a sequence: with # "
                   "for the frame's number, out_####.exr say")
      ->type_name("OUT.exr");
  flags->job.add_to(*render);
  render->add_option("--threads", flags->threads, "default: all")->type_name("N");
  render->add_option("--pixel", flags->pixel, "with --sample: print the value of one sample of this pixel")
      ->type_name("X,Y");
  render->add_option("--sample", flags->sample, "its number, from 0")->type_name("N");
  render
      ->add_option("--reference", flags->reference,
                   "the right image, of another seed: the report has the true error, too")
      ->type_name("REF.exr");
  render->add_option("--report", flags->report, "write what it cost and how large the error is, as JSON")
      ->type_name("REPORT.json");
  render->add_option("--html", flags->html, "the same as a page, with image, curves and maps in it")
      ->type_name("REPORT.html");
  render
      ->add_option("--partial-dir", flags->partial_dir,
                   "keep every unit's partial image: `lightshaft merge` folds them")
      ->type_name("DIR");
  render->add_flag("--isolate", flags->isolate, "render in a child process, which may crash");
  render->add_flag("--quiet", flags->quiet, "only warnings and errors");
  render->callback([flags, &action] { action = [flags] { return run(*flags); }; });
}

}  // namespace ls::cli
