// `lightshaft farm up --on ENGINE`: starts and stops workers as a farm's jobs need them. ENGINE (Slurm, ssh,
// Docker or Kubernetes) runs the workers.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "cli/commands/commands.h"
#include "cli/farm/farm_api.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "cli/scale/engines.h"
#include "cli/scale/farm_up.h"
#include "common/base/secret.h"
#include "common/base/spawn.h"

namespace ls::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kMostSeconds = 1e7, kMostHours = 1e9;

// Values of the options. Numbers are kept as text here; parse_options() converts them, and its error messages
// name the option.
struct FarmUpFlags {
  FarmOptions farm;
  std::string engine, name = "farm", coordinator, join_token, worker, machines, ssh_config, logs = ".",
                      report, image = "lightshaft-worker:local", like = "deployment/worker", job_budget;
  std::string workers = "1", threads = "1", finish_in = "600", idle = "60", drain = "120", poll = "5", budget,
              minutes = "60";
  std::vector<std::string> user_budgets, sbatch, docker, kubectl, worker_options;
  bool until_done = false;
};

// Checks the value of --name, which becomes part of the names of workers, Slurm jobs and files.
Result<void> check_name(const std::string& name) {
  const bool plain = !name.empty() && name.size() <= 40 && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
  if (plain) return {};
  return bad_argument(fmt::format("--name '{}': letters, digits and _, at most 40 of them", name));
}

// Reads the join token from a file, which must not be readable by everybody.
Result<std::string> read_join_token(const std::string& file) {
  if (file.empty()) return bad_argument("--join-token FILE is needed: DATA/join-token of the coordinator");
  std::error_code unknown;
  const auto mode = fs::status(file, unknown).permissions();
  if (!unknown && (mode & fs::perms::others_read) != fs::perms::none)
    return bad_argument(
        fmt::format("--join-token: everybody on this machine may read {}: chmod 600 it", file));
  auto token = read_secret(file);
  if (!token) return bad_argument("--join-token: " + token.error().message);
  return token;
}

// Returns a parser of a budget in core hours; the parsed value is in core seconds.
auto core_hours(const char* option) {
  return [=](const std::string& text) {
    return parse_positive(option, text, kMostHours).map([](double hours) { return hours * kCoreHour; });
  };
}

// Parses HOURS (a budget for each user) or USER=HOURS (a budget for one user).
Result<void> read_user_budget(const std::string& text, Budgets& budgets) {
  const auto sign = text.rfind('=');
  const auto budget = core_hours("--user-budget")(sign == std::string::npos ? text : text.substr(sign + 1));
  if (!budget) return tl::unexpected(budget.error());
  if (sign == std::string::npos)
    budgets.user = *budget;
  else
    budgets.users[text.substr(0, sign)] = *budget;
  return {};
}

Result<Budgets> parse_budgets(const FarmUpFlags& f) {
  Budgets budgets;
  if (const auto ok = take(f.job_budget, budgets.job, core_hours("--job-budget")); !ok)
    return tl::unexpected(ok.error());
  for (const std::string& text : f.user_budgets)
    if (const auto read = read_user_budget(text, budgets); !read) return tl::unexpected(read.error());
  return budgets;
}

Result<FarmUpOptions> parse_options(const FarmUpFlags& f) {
  FarmUpOptions o;
  if (const auto good = check_name(f.name); !good) return tl::unexpected(good.error());
  const auto workers = parse_whole("--workers", f.workers, 1, 10'000);
  const auto threads = parse_whole("--threads", f.threads, 1, 1024);
  if (!workers) return tl::unexpected(workers.error());
  if (!threads) return tl::unexpected(threads.error());
  o.limits.farm = f.name;
  o.limits.most_workers = static_cast<int>(*workers);
  o.limits.threads = static_cast<int>(*threads);
  struct Row {
    const char* option;
    const std::string& text;
    double& value;
  };
  for (const Row& row :
       {Row{"--finish-in", f.finish_in, o.limits.finish_in}, Row{"--idle", f.idle, o.limits.idle_seconds},
        Row{"--drain", f.drain, o.limits.drain_seconds}, Row{"--poll", f.poll, o.limits.poll_seconds}}) {
    const auto value = parse_positive(row.option, row.text, kMostSeconds);
    if (!value) return tl::unexpected(value.error());
    row.value = *value;
  }
  if (const auto ok = take(f.budget, o.limits.budget_core_seconds, core_hours("--budget")); !ok)
    return tl::unexpected(ok.error());
  auto budgets = parse_budgets(f);
  if (!budgets) return tl::unexpected(budgets.error());
  o.budgets = std::move(*budgets);
  o.until_done = f.until_done;
  o.json = f.farm.json;
  o.report = f.report.empty() ? fmt::format("lightshaft-{}.json", f.name) : f.report;
  return o;
}

Result<int> parse_minutes(const FarmUpFlags& f) {
  const auto minutes = parse_whole("--minutes", f.minutes, 1, 60 * 24 * 365);
  if (!minutes) return tl::unexpected(minutes.error());
  return static_cast<int>(*minutes);
}

Result<std::unique_ptr<Engine>> open_engine_of_pods(const FarmUpFlags& f, const FarmUpOptions& o) {
  const auto minutes = parse_minutes(f);
  if (!minutes) return tl::unexpected(minutes.error());
  return open_kubernetes({.farm = f.name,
                          .like = f.like,
                          .threads = o.limits.threads,
                          .drain_seconds = static_cast<int>(o.limits.drain_seconds),
                          .minutes = *minutes,
                          .logs = f.logs,
                          .kubectl = f.kubectl,
                          .worker_options = f.worker_options});
}

Result<std::unique_ptr<Engine>> open_engine(const FarmUpFlags& f, const FarmUpOptions& o) {
  const auto logs = check_folder("--logs", f.logs);
  if (!logs) return tl::unexpected(logs.error());
  if (f.engine == "kubernetes") return open_engine_of_pods(f, o);
  const auto token = read_join_token(f.join_token);
  if (!token) return tl::unexpected(token.error());
  if (f.coordinator.empty()) return bad_argument("--coordinator HOST:PORT is needed: as workers reach it");
  const auto program = [&](const std::string& usual) { return f.worker.empty() ? usual : f.worker; };
  const WorkerCommand worker{
      .farm = f.name,
      .program = program(f.engine == "docker" ? "lightshaft-worker"
                                              : program_beside_us("lightshaft-worker").string()),
      .coordinator = f.coordinator,
      .token_file = fs::absolute(f.join_token).string(),
      .threads = o.limits.threads,
      .options = f.worker_options};
  const std::string log_folder = fs::absolute(f.logs).string();
  const int drain_seconds = static_cast<int>(o.limits.drain_seconds);
  if (f.engine == "slurm") {
    const auto minutes = parse_minutes(f);
    if (!minutes) return tl::unexpected(minutes.error());
    return open_slurm({.worker = worker,
                       .minutes = *minutes,
                       .drain_seconds = drain_seconds,
                       .logs = log_folder,
                       .sbatch = f.sbatch});
  }
  if (f.engine == "docker")
    return open_docker({.worker = worker,
                        .join_token = *token,
                        .image = f.image,
                        .drain_seconds = drain_seconds,
                        .logs = log_folder,
                        .run = f.docker});
  if (f.machines.empty()) return bad_argument("--machines FILE is needed with --on ssh: one machine a line");
  auto machines = read_machines(f.machines);
  if (!machines) return tl::unexpected(machines.error());
  return open_ssh({.worker = worker,
                   .join_token = *token,
                   .machines = std::move(*machines),
                   .config = f.ssh_config,
                   .logs = log_folder});
}

int farm_up(const FarmUpFlags& flags) {
  Interrupt interrupt;
  const auto options = parse_options(flags);
  if (!options) return print_error(options.error());
  auto engine = open_engine(flags, *options);
  if (!engine) return print_error(engine.error());
  auto api = FarmApi::open(flags.farm);
  return api ? run_farm_up(*api, **engine, *options, interrupt) : print_error(api.error());
}

void describe(CLI::App& app, FarmUpFlags& f) {
  f.farm.add_to(app);
  app.add_option("--on", f.engine,
                 "what runs the workers: slurm, docker, kubernetes, or ssh for a list of machines")
      ->required()
      ->check(CLI::IsMember({"slurm", "ssh", "docker", "kubernetes"}));
  add_option(app, "--coordinator", f.coordinator, "HOST:PORT",
             "HOST:PORT where workers reach the coordinator; with kubernetes its manifests say it");
  add_option(app, "--join-token", f.join_token, "FILE",
             "file with the farm's join token; with slurm the workers' machines read it under this path, "
             "with kubernetes a Secret has it");
  add_option(app, "--workers", f.workers, "N", "the most workers at once; default: 1");
  add_option(app, "--threads", f.threads, "N", "of each worker; default: 1");
  add_option(app, "--finish-in", f.finish_in, "SECONDS",
             "as many workers as finish the queued work in this time; default: 600");
  add_option(app, "--idle", f.idle, "SECONDS",
             "drain a worker that has had no work for this time; default: 60");
  add_option(app, "--drain", f.drain, "SECONDS",
             "end a worker that has not drained after this time; default: 120");
  add_option(app, "--budget", f.budget, "COREHOURS", "the most to spend, over all runs with the same report");
  add_option(app, "--job-budget", f.job_budget, "COREHOURS",
             "the most to render of each job, by whichever workers");
  add_option(app, "--user-budget", f.user_budgets, "[USER=]COREHOURS",
             "the most to render for each user, or with USER= for one; may be repeated")
      ->allow_extra_args(false);
  add_option(app, "--report", f.report, "REPORT.json", "what was spent; default: lightshaft-NAME.json");
  add_option(app, "--name", f.name, "NAME", "tells several farm-ups apart; default: farm");
  app.add_flag("--until-done", f.until_done, "end when no job is queued or running");
  add_option(app, "--poll", f.poll, "SECONDS", "time between two looks; default: 5");
  add_option(app, "--logs", f.logs, "DIR", "folder for the workers' logs; default: this one");
  add_option(app, "--worker", f.worker, "PROGRAM",
             "lightshaft-worker on the workers' machines; default: the path here");
  add_option(app, "--worker-option", f.worker_options, "WORD",
             "one more word of the worker's command; may be repeated")
      ->allow_extra_args(false);
  add_option(app, "--minutes", f.minutes, "N", "slurm, kubernetes: time limit of a worker; default: 60");
  add_option(app, "--sbatch", f.sbatch, "OPTION",
             "slurm: one more option of sbatch, --sbatch=--partition=low say")
      ->allow_extra_args(false);
  add_option(app, "--image", f.image, "IMAGE",
             "docker: image of the workers; default: lightshaft-worker:local");
  add_option(app, "--docker", f.docker, "OPTION",
             "docker: one more option of docker run, --docker=--network=host say")
      ->allow_extra_args(false);
  add_option(app, "--like", f.like, "KIND/NAME",
             "kubernetes: what has the template of a worker's pod; default: deployment/worker");
  add_option(app, "--kubectl", f.kubectl, "OPTION",
             "kubernetes: one more option of kubectl, --kubectl=--namespace=lightshaft say")
      ->allow_extra_args(false);
  add_option(app, "--machines", f.machines, "FILE", "ssh: the machines, one a line");
  add_option(app, "--ssh-config", f.ssh_config, "FILE",
             "ssh: configuration file to use instead of the usual one");
}

}  // namespace

void add_farm_up(CLI::App& app, Action& action) {
  CLI::App* farm = app.add_subcommand("farm", "workers that come and go with the jobs of a farm");
  farm->require_subcommand(1);
  const auto [up, flags] = add_command<FarmUpFlags>(
      *farm, action, "up", "starts workers while jobs need them, until Ctrl-C", farm_up);
  describe(*up, *flags);
}

}  // namespace ls::cli
