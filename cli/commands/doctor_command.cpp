// `lightshaft doctor`: checks whether this machine can render, and whether a farm can be used from it. It
// changes nothing.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "cli/commands/commands.h"
#include "cli/doctor/findings.h"
#include "cli/farm/farm_api.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/reply_fields.h"
#include "core/base/safe_text.h"

namespace ls::cli {
namespace {

using nlohmann::ordered_json;

struct DoctorFlags {
  FarmOptions farm;
  std::string cache, data, join;
};

void print_findings(const std::vector<Finding>& findings) {
  for (const Finding& each : findings) {
    const std::string about = each.subject.empty() ? each.what : each.subject + ": " + each.what;
    print(plain_text(fmt::format("{:<8} {:<15} {}", to_string(each.status), each.name, about)));
    if (!each.advice.empty()) print(fmt::format("{:<24} to do: {}", "", plain_text(each.advice)));
  }
  const auto count = [&](Status status) {
    return std::count_if(findings.begin(), findings.end(),
                         [&](const Finding& each) { return each.status == status; });
  };
  print(fmt::format("problems: {}, warnings: {}", count(Status::problem), count(Status::warning)));
}

std::string findings_json(const std::vector<Finding>& findings) {
  auto checks = ordered_json::array();
  for (const Finding& each : findings)
    checks.push_back({{"name", each.name},
                      {"subject", each.subject},
                      {"status", to_string(each.status)},
                      {"what", each.what},
                      {"advice", each.advice}});
  return dump(ordered_json{{"status", to_string(worst(findings))}, {"checks", std::move(checks)}});
}

int run_doctor(const DoctorFlags& flags) {
  const MachineFacts machine = observe_machine(flags.cache, flags.data);
  std::vector<Finding> findings = judge_machine(machine);
  if (!flags.join.empty()) {
    const auto joining = observe_joining(flags.join);
    if (!joining) return print_error(joining.error());
    findings.push_back(judge_joining(*joining));
  }
  const char* variable = std::getenv("LIGHTSHAFT_URL");
  if (flags.farm.url.empty() && (!variable || !*variable)) {
    findings.push_back({"farm",
                        {},
                        Status::ok,
                        "not checked: no address was given",
                        "give --farm URL or LIGHTSHAFT_URL to check a farm"});
  } else {
    const auto connection = connection_of(flags.farm);
    if (!connection) return print_error(connection.error());
    const auto farm = observe_farm(*connection);
    if (!farm) return print_error(farm.error());
    for (const FarmFacts& facts : *farm)
      for (Finding& each : judge_farm(facts, LIGHTSHAFT_VERSION, machine.numeric_class))
        findings.push_back(std::move(each));
  }
  if (flags.farm.json) print(findings_json(findings));
  if (!flags.farm.json) print_findings(findings);
  return worst(findings) == Status::problem ? kFailed : kOk;
}

}  // namespace

void add_doctor(CLI::App& app, Action& action) {
  const auto [doctor, flags] = add_command<DoctorFlags>(
      app, action, "doctor",
      "check this machine and its access to a farm; exit code 1 if something does not work", run_doctor);
  flags->farm.add_to(*doctor);
  add_option(*doctor, "--farm", flags->farm.url, "URL", "the same as --to")->excludes("--to");
  add_option(*doctor, "--join", flags->join, "HOST:PORT",
             "also try this port for joining, as `lightshaft up --lan` names it");
  add_option(*doctor, "--cache", flags->cache, "DIR",
             "cache folder of a worker; default: the one of this user's workers");
  add_option(*doctor, "--data", flags->data, "DIR", "also check this data folder of a coordinator");
}

}  // namespace ls::cli
