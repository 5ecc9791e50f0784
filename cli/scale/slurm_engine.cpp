#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "cli/scale/child_command.h"
#include "cli/scale/engines.h"
#include "common/base/parse_number.h"

namespace ls::cli {
namespace {

using State = EngineWorker::State;

constexpr double kTimeLimit = 60;          // seconds allowed for one command of Slurm, such as squeue
constexpr std::size_t kMostInACall = 500;  // largest number of jobs in one call of scancel

// The job's script. The worker's command line is passed as arguments, so that no shell parses it. `exec`
// makes the worker the process that Slurm signals. The token is in a file that only its owner can read, since
// other users may see the arguments of a job. The cache is on the scratch disk that Slurm or the site gives
// the job; workers of one user on one machine share it.
constexpr const char* kScript = R"sh(#!/bin/sh
scratch=${SLURM_TMPDIR:-${TMPDIR:-/tmp}}
exec "$@-${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" --cache "$scratch/lightshaft-$(id -u)"
)sh";

// Parses Slurm's [days-]hours:minutes:seconds, where leading parts may be missing.
std::optional<double> seconds_of(std::string_view text) {
  double days = 0, seconds = 0;
  const auto number = [](std::string_view digits) -> std::optional<double> {
    const auto value = parse_number<int>(digits);
    return value && *value >= 0 ? std::optional<double>(*value) : std::nullopt;
  };
  if (const auto dash = text.find('-'); dash != std::string_view::npos) {
    const auto value = number(text.substr(0, dash));
    if (!value) return std::nullopt;
    days = *value;
    text.remove_prefix(dash + 1);
  }
  for (;;) {
    const auto colon = text.find(':');
    const auto value = number(text.substr(0, colon));
    if (!value) return std::nullopt;
    seconds = seconds * 60 + *value;
    if (colon == std::string_view::npos) return days * 86400 + seconds;
    text.remove_prefix(colon + 1);
  }
}

class Slurm final : public Engine {
 public:
  Slurm(SlurmOptions options, std::string version)
      : Engine(std::move(version)), options_(std::move(options)) {}

  Result<std::vector<EngineWorker>> list() override {
    const auto lines =
        run({"squeue", "--me", "--noheader", "--array", "--name=" + job_name(),
             "--states=PENDING,CONFIGURING,RUNNING,COMPLETING,SUSPENDED,STOPPED,RESIZING,REQUEUED,"
             "REQUEUE_HOLD,SPECIAL_EXIT,SIGNALING",
             "--format=%i|%T|%M|%C|%r"});
    return lines ? parse_squeue(*lines) : tl::unexpected(lines.error());
  }

  Result<std::vector<std::string>> start(int count) override {
    const WorkerCommand& w = options_.worker;
    Words words{"sbatch",
                "--parsable",
                "--job-name=" + job_name(),
                fmt::format("--array=1-{}", count),
                "--ntasks=1",
                fmt::format("--cpus-per-task={}", w.threads),
                fmt::format("--time={}", options_.minutes),
                fmt::format("--signal=B:TERM@{}", options_.drain_seconds),
                "--requeue",
                "--open-mode=append",
                "--export=NONE",
                fmt::format("--output={}/{}-%A_%a.log", options_.logs, job_name())};
    words.insert(words.end(), options_.sbatch.begin(), options_.sbatch.end());
    words.insert(words.end(), {"/dev/stdin", w.program, "--coordinator", w.coordinator, "--threads",
                               std::to_string(w.threads), "--token-file", w.token_file});
    words.insert(words.end(), w.options.begin(), w.options.end());
    words.insert(words.end(), {"--name", w.farm});  // the script appends the job's id to this name
    const auto started = run(words, kScript);
    if (!started) return tl::unexpected(started.error());
    // With --parsable, sbatch prints JOB or JOB;CLUSTER.
    const std::string job = started->substr(0, started->find_first_of(";\n"));
    std::vector<std::string> ids;
    for (int task = 1; task <= count; ++task) ids.push_back(fmt::format("{}_{}", job, task));
    return ids;
  }

  Result<void> drain(std::span<const EngineWorker> workers) override {
    // With --batch only the worker itself gets the signal. With --state=PENDING, jobs that have started since
    // they were listed are left alone; they are drained after the next list.
    const auto drained = scancel({"--batch", "--signal=TERM"}, ids_of(workers, true));
    const auto withdrawn = scancel({"--state=PENDING"}, ids_of(workers, false));
    return drained ? withdrawn : drained;
  }

  Result<void> kill(std::span<const EngineWorker> workers) override { return scancel({}, ids_of(workers)); }

 private:
  std::string job_name() const { return "lightshaft-" + options_.worker.farm; }

  static Result<std::string> run(const Words& words, const std::string& input = "") {
    auto output = run_command(words, input, kTimeLimit);
    if (!output) return tl::unexpected(output.error());
    if (output->code != 0)
      return fail(Errc::unavailable, fmt::format("{}: {}", words.front(), first_line(output->err)));
    return std::move(output->out);
  }

  static Result<void> scancel(const Words& options, std::span<const std::string> jobs) {
    for (; !jobs.empty(); jobs = jobs.subspan(std::min(jobs.size(), kMostInACall))) {
      Words words{"scancel"};
      words.insert(words.end(), options.begin(), options.end());
      const auto some = jobs.first(std::min(jobs.size(), kMostInACall));
      words.insert(words.end(), some.begin(), some.end());
      const auto done = run_command(words, "", kTimeLimit);
      if (!done) return tl::unexpected(done.error());
      if (done->code != 0 && !only_ended(done->err))
        return fail(Errc::unavailable, "scancel: " + first_line(done->err));
    }
    return {};
  }

  // True if scancel complains only about jobs that have ended since they were listed, which is no error. The
  // call must not be repeated: the other jobs have received their signal, and a second SIGTERM stops a worker
  // immediately.
  static bool only_ended(const std::string& complaints) {
    return !complaints.empty() && std::ranges::all_of(split(complaints, '\n'), [](const std::string& line) {
      return line.find("already completing or completed") != std::string::npos ||
             line.find("Invalid job id") != std::string::npos;
    });
  }

  SlurmOptions options_;
};

}  // namespace

Result<std::unique_ptr<Engine>> open_slurm(SlurmOptions options) {
  const auto version = run_command({"sbatch", "--version"}, "", kTimeLimit);
  if (!version || version->code != 0)
    return fail(Errc::failed_precondition,
                "sbatch does not run here: run this on a machine that submits jobs to Slurm");
  return std::make_unique<Slurm>(std::move(options), first_line(version->out));
}

Result<std::vector<EngineWorker>> parse_squeue(const std::string& lines) {
  std::vector<EngineWorker> workers;
  for (const std::string& line : split(lines, '\n')) {
    if (line.empty()) continue;
    const std::vector<std::string> fields = split(line, '|');
    const auto seconds = fields.size() >= 4 ? seconds_of(fields[2]) : std::nullopt;
    int cores = 0;
    if (seconds) std::from_chars(fields[3].data(), fields[3].data() + fields[3].size(), cores);
    if (!seconds || cores < 1) return bad_argument(fmt::format("squeue answered '{}'", line));
    const std::string& state = fields[1];
    const std::string reason = fields.size() > 4 ? fields[4] : "";
    // Two kinds of jobs count as stuck, so that other workers are started instead: jobs that Slurm holds
    // because several attempts to start them failed, and jobs that Slurm delays by two minutes (BeginTime)
    // after it has requeued them because their node was lost.
    const bool held = state == "REQUEUE_HOLD" || state == "SPECIAL_EXIT" ||
                      (state == "PENDING" && reason.find("requeued held") != std::string::npos) ||
                      (state == "PENDING" && (reason.starts_with("JobHeld") || reason == "BeginTime"));
    // A job that is being requeued is COMPLETING at first, and still occupies its cores.
    const bool running = state == "RUNNING" || state == "COMPLETING" || state == "SUSPENDED" ||
                         state == "STOPPED" || state == "SIGNALING";
    workers.push_back({fields[0],
                       held      ? State::stuck
                       : running ? State::running
                                 : State::waiting,
                       *seconds, cores});
  }
  return workers;
}

}  // namespace ls::cli
