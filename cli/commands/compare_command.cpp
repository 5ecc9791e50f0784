// The options of `lightshaft compare`, which races integrators. The command is written in Python
// (python/src/lightshaft_command/race).
#include <fmt/format.h>

#include <filesystem>

#include "cli/commands/commands.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "core/job/limits.h"
#include "util/report/log_plot.h"
#include "worker/machine.h"

namespace ls::cli {
namespace {

constexpr std::uint64_t kMostSeeds = 100, kUsualSeeds = 5;

struct CompareFlags {
  std::vector<std::string> scenes, integrators, reference, defines;
  std::string time, spp, seeds, first_seed, threads, size, references, report, clock = "wall";
  bool strict = false, quiet = false;
};

// Checks what Python then takes as it is.
Result<void> check(const CompareFlags& flags) {
  const auto cores = static_cast<std::uint64_t>(worker::usable_cpus());
  std::uint64_t spp = 0, seeds = kUsualSeeds, first_seed = 0, threads = 0;
  double time = 0;
  FrameSize size;
  for (const auto& ok :
       {take(flags.time, time, positive("--time", kMaxSeconds)),
        take(flags.spp, spp, whole("--spp", 2, kMaxSpp)),
        take(flags.seeds, seeds, whole("--seeds", 1, kMostSeeds)),
        take(flags.first_seed, first_seed, whole("--seed", 0, UINT64_MAX - kMostSeeds)),
        take(flags.threads, threads, whole("--threads", 1, cores)), take(flags.size, size, parse_size)})
    if (!ok) return ok;
  if (const auto defines = parse_defines(flags.defines); !defines) return tl::unexpected(defines.error());
  if (flags.reference.size() > 2)
    return bad_argument("--reference: one picture, or two that are independent of each other");
  if (!flags.reference.empty() && flags.scenes.size() > 1)
    return bad_argument(
        "--reference is of one scene; for several: --references DIR with NAME.exr, or NAME.0.exr and "
        "NAME.1.exr");
  if (!flags.reference.empty() && !flags.references.empty())
    return bad_argument("--reference and --references: give one of them");
  std::error_code none;
  if (!flags.references.empty() && !std::filesystem::is_directory(flags.references, none))
    return bad_argument(fmt::format("--references: there is no folder {}", flags.references));
  if (flags.reference.empty() && flags.references.empty() && seeds < 2)
    return bad_argument(
        "--seeds 1 needs a --reference: without one pictures are measured against those of other seeds");
  if (flags.integrators.size() > report::kMostCurves)
    return bad_argument(fmt::format("at most {} entrants in one race", report::kMostCurves));
  std::error_code error;
  std::filesystem::create_directories(flags.report, error);
  if (error) return bad_argument(fmt::format("--report {}: {}", flags.report, error.message()));
  return check_folder("--report", flags.report);
}

void add_options(CLI::App& compare, CompareFlags& flags) {
  add_option(compare, "scenes", flags.scenes, "SCENE...", "one scene, or a set")->required();
  add_option(compare, "--integrators", flags.integrators, "A,B", "those that race; default: the scene's")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_option(compare, "--time", flags.time, "SECONDS",
             "time that each entrant may render for each seed, after loading the scene")
      ->required();
  add_option(compare, "--clock", flags.clock, "wall|cpu",
             "wall, or cpu: CPU seconds over threads, for a busy machine")
      ->check(CLI::IsMember({"wall", "cpu"}));
  add_option(compare, "--spp", flags.spp, "N",
             "end a render at N samples a pixel if that comes before the time is over");
  add_option(compare, "--seeds", flags.seeds, "K", "renders of each entrant (default 5)");
  add_option(compare, "--seed", flags.first_seed, "N", "the first seed; the others follow it (default 0)");
  add_option(compare, "--threads", flags.threads, "N",
             "threads, and cores, that each entrant may use; default: all");
  add_option(compare, "--size", flags.size, "WxH", "size of the image instead of the scene's");
  add_option(compare, "--reference", flags.reference, "REF.exr[,REF2.exr]",
             "the right picture, or two independent ones; default: the other seeds' pictures")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_option(compare, "--references", flags.references, "DIR",
             "folder with the references of several scenes: NAME.exr, or NAME.0.exr and NAME.1.exr");
  add_defines(compare, flags.defines);
  add_option(compare, "--report", flags.report, "DIR", "the folder for page, plots and tables")->required();
  compare.add_flag("--strict", flags.strict, "warnings of the scene are errors");
  compare.add_flag("--quiet", flags.quiet, "only warnings, errors and the figures");
}

}  // namespace

void add_compare(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<CompareFlags>();
  CLI::App* compare = app.add_subcommand("compare", "race integrators: error against time, with intervals");
  add_options(*compare, *flags);
  compare->callback([compare, flags, &action] {
    action = [compare, flags] {
      if (const auto ok = check(*flags); !ok) return print_error(ok.error());
      return run_in_python("compare", given_options(*compare));
    };
  });
}

}  // namespace ls::cli
