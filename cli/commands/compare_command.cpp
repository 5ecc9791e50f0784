// lightshaft compare: renders scenes with several integrators and compares how fast their errors fall.
#include <fmt/format.h>

#include <atomic>

#include "cli/commands/commands.h"
#include "cli/commands/compare_scenes.h"
#include "cli/output/console.h"
#include "cli/output/interrupt.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "common/job/limits.h"
#include "common/report/log_plot.h"
#include "compare/race_machine.h"
#include "compare/results.h"
#include "worker/machine.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

constexpr std::uint64_t kMostSeeds = 100;

struct CompareFlags {
  std::vector<std::string> scenes, integrators, reference, defines;
  std::string time, spp, seeds, first_seed, threads, size, references, report, clock = "wall";
  bool strict = false, quiet = false;
};

Result<void> take_numbers(const CompareFlags& flags, CompareOptions& options) {
  const auto time = parse_positive("--time", flags.time, kMaxSeconds);
  if (!time) return tl::unexpected(time.error());
  options.conditions.time = *time;
  options.conditions.clock = flags.clock == "cpu" ? race::RaceClock::cpu : race::RaceClock::wall;
  auto cores = static_cast<std::uint64_t>(worker::usable_cpus());
  std::uint64_t spp = options.conditions.most_spp, seeds = options.seeds;
  for (const auto& ok :
       {take(flags.spp, spp, whole("--spp", 2, kMaxSpp)),
        take(flags.seeds, seeds, whole("--seeds", 1, kMostSeeds)),
        take(flags.first_seed, options.first_seed, whole("--seed", 0, UINT64_MAX - kMostSeeds)),
        take(flags.threads, cores, whole("--threads", 1, cores)), take(flags.size, options.size, parse_size)})
    if (!ok) return ok;
  options.conditions.most_spp = spp;
  options.conditions.threads = static_cast<int>(cores);
  options.seeds = seeds;
  return {};
}

Result<void> take_reference(const CompareFlags& flags, CompareOptions& options) {
  if (flags.reference.size() > 2)
    return bad_argument("--reference: one picture, or two that are independent of each other");
  if (!flags.reference.empty() && flags.scenes.size() > 1)
    return bad_argument(
        "--reference is of one scene; for several: --references DIR with NAME.exr, or NAME.0.exr and "
        "NAME.1.exr");
  if (!flags.reference.empty() && !flags.references.empty())
    return bad_argument("--reference and --references: give one of them");
  options.reference.assign(flags.reference.begin(), flags.reference.end());
  options.references = flags.references;
  std::error_code none;
  if (!flags.references.empty() && !std::filesystem::is_directory(options.references, none))
    return bad_argument(fmt::format("--references: there is no folder {}", flags.references));
  if (options.reference.empty() && options.references.empty() && options.seeds < 2)
    return bad_argument(
        "--seeds 1 needs a --reference: without one pictures are measured against those of other seeds");
  return {};
}

Result<void> make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return bad_argument(fmt::format("--report {}: {}", folder.string(), error.message()));
  return check_folder("--report", folder);
}

Result<CompareOptions> options_of(const CompareFlags& flags) {
  CompareOptions options;
  options.scenes = flags.scenes;
  options.integrators = flags.integrators;
  options.report = flags.report;
  options.strict = flags.strict;
  options.quiet = flags.quiet;
  auto defines = parse_defines(flags.defines);
  if (!defines) return tl::unexpected(defines.error());
  options.defines = std::move(*defines);
  for (const auto take_part : {take_numbers, take_reference})
    if (auto ok = take_part(flags, options); !ok) return tl::unexpected(ok.error());
  if (options.integrators.size() > report::kMostCurves)
    return bad_argument(fmt::format("at most {} entrants in one race", report::kMostCurves));
  if (auto ok = make_folder(options.report); !ok) return tl::unexpected(ok.error());
  return options;
}

Result<void> write(const std::filesystem::path& folder, const race::Results& results) {
  for (const auto& [name, text] : files_of(results))
    if (auto ok = write_output(folder / name, text); !ok) return ok;
  return {};
}

void print_rows(const race::Race& race) {
  for (const race::Row& row : race::rows_of(race)) {
    std::string line = fmt::format("{}: {}: {:.4g} samples in {:.3g} s, relMSE {}, efficiency {}", race.scene,
                                   race.entrants[row.entrant].name, row.spp, row.seconds,
                                   race::with_interval(row.relmse), race::with_interval(row.efficiency));
    if (row.ratio)
      line +=
          fmt::format("; {} is {} times as efficient", race.entrants[0].name, race::with_interval(row.ratio));
    print(line);
  }
}

void warn_if_busy(const CompareOptions& options) {
  constexpr double kIdleLoad = .5;
  const double load = race::load_average();
  if (load > kIdleLoad && options.conditions.clock == race::RaceClock::wall)
    print_note(fmt::format(
        "lightshaft: warning: the machine is busy or just was (load average {:.1f}): wall seconds of "
        "a busy one say little; --clock cpu counts CPU seconds",
        load));
}

int run(const CompareFlags& flags) {
  // Declared before `interrupt`, so that it outlives the thread of `interrupt`, which sets it.
  std::atomic<bool> stop{false};
  Interrupt interrupt;
  auto options = options_of(flags);
  if (!options) return print_error(options.error());
  race::Results results;
  const race::Others others;
  results.machine = {race::machine_words(options->conditions.threads), -1, version_text()};
  if (const auto ok = race::use_cores(options->conditions.threads); !ok) return print_error(ok.error());
  warn_if_busy(*options);
  const auto limit = render::limit_threads(options->conditions.threads);
  interrupt.on_signal([&] { stop = true; });
  results.seeds = options->seeds;
  results.first_seed = options->first_seed;
  const auto names = scene_names(options->scenes);
  bool failed = false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    auto race = race_scene(*options, options->scenes[i], names[i], stop);
    if (!race) return print_rejected(race.error());
    for (const race::Failure& f : race->failures)
      complain(fmt::format("{}: {}", race->scene, f.why)), failed = true;
    print_rows(*race);
    results.races.push_back(std::move(*race));
    results.machine.others = others.share();
    if (const auto ok = write(options->report, results); !ok) return print_error(ok.error());
  }
  if (!options->quiet)
    print_note(fmt::format("lightshaft: written: {}", (options->report / "index.html").string()));
  return failed ? kFailed : kOk;
}

void add_options(CLI::App& compare, CompareFlags& flags) {
  add_option(compare, "scenes", flags.scenes, "SCENE...", "one scene, or a set")->required();
  add_option(compare, "--integrators", flags.integrators, "A,B", "those that race; default: the scene's")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_option(compare, "--time", flags.time, "SECONDS", "that each entrant has for each seed, after loading")
      ->required();
  add_option(compare, "--clock", flags.clock, "wall|cpu",
             "wall, or cpu: CPU seconds over threads, for a busy machine")
      ->check(CLI::IsMember({"wall", "cpu"}));
  add_option(compare, "--spp", flags.spp, "N", "stop at so many samples if that comes first");
  add_option(compare, "--seeds", flags.seeds, "K", "renders of each entrant (default 5)");
  add_option(compare, "--seed", flags.first_seed, "N", "the first of them (default 0)");
  add_option(compare, "--threads", flags.threads, "N", "and cores, for everybody; default: all");
  add_option(compare, "--size", flags.size, "WxH", "size of the image instead of the scene's");
  add_option(compare, "--reference", flags.reference, "REF.exr[,REF2.exr]",
             "the right picture, or two independent ones; default: the other seeds' pictures")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_option(compare, "--references", flags.references, "DIR",
             "of a set: a folder with NAME.exr, or NAME.0.exr and NAME.1.exr");
  add_defines(compare, flags.defines);
  add_option(compare, "--report", flags.report, "DIR", "the folder for page, plots and tables")->required();
  compare.add_flag("--strict", flags.strict, "warnings of the scene are errors");
  compare.add_flag("--quiet", flags.quiet, "only warnings, errors and the figures");
}

}  // namespace

void add_compare(CLI::App& app, Action& action) {
  const auto [compare, flags] = add_command<CompareFlags>(
      app, action, "compare", "race integrators: error against time, with intervals", run);
  add_options(*compare, *flags);
}

}  // namespace ls::cli
