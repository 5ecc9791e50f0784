// The options of `lightshaft farm up --on ENGINE`, which starts and stops workers as a farm's jobs need them.
// The command is written in Python (python/src/lightshaft_command/farm_up).
#include "cli/commands/commands.h"
#include "cli/farm/farm_api.h"

namespace ls::cli {
namespace {

void describe(CLI::App& app, FarmOptions& farm) {
  farm.add_to(app);
  const auto option = [&](const char* name, const char* type, const char* help) {
    pass_option(app, name, type, help);
  };
  const auto repeated = [&](const char* name, const char* type, const char* help) {
    pass_options(app, name, type, help);
  };
  app.add_option("--on")
      ->description("what runs the workers: slurm, docker, kubernetes, or ssh for a list of machines")
      ->required()
      ->check(CLI::IsMember({"slurm", "ssh", "docker", "kubernetes"}));
  option("--coordinator", "HOST:PORT",
         "HOST:PORT where workers reach the coordinator; with kubernetes its manifests say it");
  option("--join-token", "FILE",
         "file with the farm's join token; with slurm the workers' machines read it under this path, "
         "with kubernetes a Secret has it");
  option("--workers", "N", "the most workers at once; default: 1");
  option("--threads", "N", "of each worker; default: 1");
  option("--finish-in", "SECONDS", "as many workers as finish the queued work in this time; default: 600");
  option("--idle", "SECONDS", "drain a worker that has had no work for this time; default: 60");
  option("--drain", "SECONDS", "end a worker that has not drained after this time; default: 120");
  option("--budget", "COREHOURS", "the most to spend, over all runs with the same report");
  option("--job-budget", "COREHOURS", "the most to render of each job, by whichever workers");
  repeated("--user-budget", "[USER=]COREHOURS",
           "the most to render for each user, or with USER= for one; may be repeated");
  option("--report", "REPORT.json", "what was spent; default: lightshaft-NAME.json");
  option("--name", "NAME", "tells several farm-ups apart; default: farm");
  app.add_flag("--until-done")->description("end when no job is queued or running");
  option("--poll", "SECONDS", "seconds between two checks of jobs and workers; default: 5");
  option("--logs", "DIR", "folder for the workers' logs; default: this one");
  option("--worker", "PROGRAM", "lightshaft-worker on the workers' machines; default: the path here");
  repeated("--worker-option", "WORD", "one more word of the worker's command; may be repeated");
  option("--minutes", "N", "slurm, kubernetes: time limit of a worker; default: 60");
  repeated("--sbatch", "OPTION", "slurm: one more option of sbatch, for example --sbatch=--partition=low");
  option("--image", "IMAGE", "docker: image of the workers; default: lightshaft-worker:local");
  repeated("--docker", "OPTION",
           "docker: one more option of docker run, for example --docker=--network=host");
  option("--like", "KIND/NAME",
         "kubernetes: what has the template of a worker's pod; default: deployment/worker");
  repeated("--kubectl", "OPTION",
           "kubernetes: one more option of kubectl, for example --kubectl=--namespace=lightshaft");
  option("--machines", "FILE", "ssh: the machines, one a line");
  option("--ssh-config", "FILE", "ssh: configuration file to use instead of the usual one");
}

}  // namespace

void add_farm_up(CLI::App& app, Action& action) {
  CLI::App* farm = app.add_subcommand("farm", "workers that come and go with the jobs of a farm");
  farm->require_subcommand(1);
  CLI::App* up = farm->add_subcommand("up", "starts workers while jobs need them, until Ctrl-C");
  const auto connection = std::make_shared<FarmOptions>();
  describe(*up, *connection);
  up->callback(
      [connection, up, &action] { action = [up] { return run_in_python("farm up", given_options(*up)); }; });
}

}  // namespace ls::cli
