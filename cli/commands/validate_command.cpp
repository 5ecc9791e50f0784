// lightshaft validate: tests the renderer, with the built-in table of cases whose answers are known or, given
// FILE, with the tests in a file of the Nori renderer.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/commands/commands.h"
#include "cli/local/local_scene.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "common/base/safe_text.h"
#include "validation/nori_test_run.h"
#include "validation/run.h"
#include "worker/machine.h"
#include "worker/render/base/build_id.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

struct ValidateFlags {
  std::string file, json, only;
  std::uint64_t seed = 0;
  int threads = 0;
  bool strict = false, quick = false;
};

// Adds the build, the numeric class (machines of one class render the same bits), the seed and --case, so
// that nobody mixes results of different builds or options.
void add_origin(nlohmann::ordered_json& json, const ValidateFlags& flags) {
  json["build"] = render::kBuildId;
  json["numeric_class"] = render::numeric_class().hex();
  json["seed"] = flags.seed;
  if (!flags.only.empty()) json["only"] = flags.only;
}

int report(const std::vector<ValidateCase>& lines, nlohmann::ordered_json json, const ValidateFlags& flags) {
  if (lines.empty()) return usage_error(fmt::format("--case {}: there is no such case", flags.only));
  std::size_t failed = 0;
  for (const ValidateCase& c : lines) failed += c.passed() ? 0 : 1;
  print(fmt::format("{} of {} cases passed", lines.size() - failed, lines.size()));
  if (!flags.json.empty()) {
    add_origin(json, flags);
    if (const auto saved = save_result(flags.json, json.dump(2) + "\n"); !saved)
      return print_error(saved.error());
  }
  return failed > 0 ? kFailed : kOk;
}

// Returns the results `lines` as JSON, with the table's significance level and the cases that --quick has
// left out. The docs page is generated from this JSON; tests/system/test_validation_table.py checks that
// every required case is in it or has a test of its own.
nlohmann::ordered_json table_with_rows(const cases::Table& table, const std::vector<ValidateCase>& lines,
                                       bool quick) {
  nlohmann::ordered_json json = table_json(lines);
  json["level"] = level_of(table);
  json["left_out"] = nlohmann::ordered_json::array();
  for (const cases::Case& c : table.cases())
    if (quick && c.options.slow) json["left_out"].push_back({{"name", c.id}, {"rows", c.rows}});
  return json;
}

int run_table(const ValidateFlags& flags) {
  cases::RunOptions options;
  options.threads = flags.threads > 0 ? flags.threads : worker::usable_cpus();
  options.seed = flags.seed;
  options.quick = flags.quick;
  options.only = flags.only;
  options.done = [](const ValidateCase& c) { print(table_line(c)); };
  const cases::Table table = cases::all_cases();
  print(table_heading());
  const auto lines = run_cases(table, options);
  return report(lines, table_with_rows(table, lines, flags.quick), flags);
}

int run_file(const ValidateFlags& flags) {
  auto local = read_local_test(flags.file, flags.strict);
  if (!local) return print_rejected(local.error());
  print_diagnostics(local->warnings);
  render::AssetFiles files;
  for (const auto& [name, file] : local->files) files.emplace(file.digest, file.path);

  ValidateOptions options;
  options.threads = flags.threads > 0 ? flags.threads : worker::usable_cpus();
  options.seed = flags.seed;
  options.only = flags.only;
  options.done = [](const ValidateCase& c) { print(table_line(c)); };
  print(table_heading());
  const auto lines = validate_test(local->test, files, options);
  if (!lines) return print_error(lines.error());
  return report(*lines, table_json(*lines), flags);
}

int run(const ValidateFlags& flags) {
  if (!flags.json.empty())
    if (const auto ok = check_output("--json", flags.json); !ok) return print_error(ok.error());
  if (flags.file.empty()) return run_table(flags);
  if (flags.quick)
    return usage_error("--quick is for the table: a FILE's tests say themselves how many paths they take");
  return run_file(flags);
}

}  // namespace

void add_validate(CLI::App& app, Action& action) {
  const auto [validate, flags] = add_command<ValidateFlags>(
      app, action, "validate",
      "check the renderer against known answers: stiff and extreme cases, or the tests of a Nori file "
      "(ttest, chi2test); exit code 0 if all pass, 1 if not",
      run);
  add_option(*validate, "file", flags->file, "FILE", "Nori XML with a <test>; without: the table of cases");
  add_option(*validate, "--case", flags->only, "NAME",
             "only the cases whose names begin so or match the glob; of FILE: with this in their name");
  validate->add_flag("--quick", flags->quick, "bands of 1 % for .3 %, without the longest cases");
  add_option(*validate, "--json", flags->json, "OUT", "the table as JSON, too");
  add_option(*validate, "--seed", flags->seed, "N", "default 0");
  add_option(*validate, "--threads", flags->threads, "N", "default all")->check(CLI::Range(1, 1024));
  validate->add_flag("--strict", flags->strict, "warnings are errors");
}

}  // namespace ls::cli
