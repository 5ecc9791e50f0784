// lightshaft validate FILE: the tests of a Nori file.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/local_scene.h"
#include "cli/output_file.h"
#include "cli/say.h"
#include "cli/validate_file.h"
#include "common/base/plain_text.h"
#include "worker/machine.h"

namespace ls::cli {
namespace {

struct Flags {
  std::string file, json, only;
  std::uint64_t seed = 0;
  int threads = 0;
  bool strict = false;
};

int run(const Flags& flags) {
  if (!flags.json.empty())
    if (const auto ok = check_output("--json", flags.json); !ok) return say_error(ok.error());
  auto local = read_local_test(flags.file, flags.strict);
  if (!local) return say_rejected(local.error());
  say_diagnostics(local->warnings);
  render::AssetFiles files;
  for (const auto& [name, file] : local->files) files.emplace(file.digest, file.path);

  ValidateOptions options;
  options.threads = flags.threads > 0 ? flags.threads : worker::usable_cpus();
  options.seed = flags.seed;
  options.only = flags.only;
  options.done = [](const ValidateCase& c) { print(table_line(c)); };
  print(table_heading());
  const auto cases = validate_test(local->test, files, options);
  if (!cases) return say_error(cases.error());
  if (cases->empty()) return usage_error(fmt::format("--case {}: no case has this in its name", flags.only));
  std::size_t failed = 0;
  for (const ValidateCase& c : *cases) failed += c.passed() ? 0 : 1;
  print(fmt::format("{} of {} cases passed", cases->size() - failed, cases->size()));
  if (!flags.json.empty())
    if (const auto saved = save_result(flags.json, table_json(*cases).dump(2) + "\n"); !saved)
      return say_error(saved.error());
  return failed > 0 ? kFailed : kOk;
}

}  // namespace

void add_validate(CLI::App& app, Action& action) {
  auto flags = std::make_shared<Flags>();
  CLI::App* validate = app.add_subcommand(
      "validate", "run the tests of a Nori file (ttest, chi2test); exit code 0 if all pass, 1 if not");
  validate->add_option("file", flags->file, "Nori XML with a <test>")->required()->type_name("FILE");
  validate->add_option("--case", flags->only, "only the cases with this in their name")->type_name("NAME");
  validate->add_option("--json", flags->json, "the table as JSON, too")->type_name("OUT");
  validate->add_option("--seed", flags->seed, "default 0")->type_name("N");
  validate->add_option("--threads", flags->threads, "default all")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  validate->add_flag("--strict", flags->strict, "warnings are errors");
  validate->callback([flags, &action] { action = [flags] { return run(*flags); }; });
}

}  // namespace ls::cli
