#include <fmt/format.h>

#include <algorithm>

#include "cli/scale/child_command.h"
#include "cli/scale/engines.h"
#include "common/base/clock.h"
#include "common/base/parse_number.h"

namespace ls::cli {
namespace {

using State = EngineWorker::State;

constexpr double kDockerLimit = 60;      // seconds allowed for a command of Docker except `docker run`
constexpr double kDockerRunLimit = 600;  // seconds allowed for `docker run`, which may fetch the image first

// The container's command waits at a named pipe for the farm's token. The pipe is in the container's /tmp,
// which is in memory. So the token is in no argument, in no file, and not in the environment that `docker
// inspect` shows; only the worker's own environment has it, which its user and root can read. This command
// and kGiveToken both try to make the pipe, since either may run first.
constexpr const char* kTakeToken =
    "mkfifo -m 600 /tmp/join-token 2>/dev/null; IFS= read -r LIGHTSHAFT_JOIN_TOKEN </tmp/join-token; "
    "export LIGHTSHAFT_JOIN_TOKEN; exec \"$@\"";
constexpr const char* kGiveToken = "mkfifo -m 600 /tmp/join-token 2>/dev/null; exec cat >/tmp/join-token";

class Docker final : public Engine {
 public:
  Docker(DockerOptions options, std::string version)
      : Engine(std::move(version)), options_(std::move(options)) {}

  Result<std::vector<EngineWorker>> list() override {
    const auto lines =
        run({"docker", "ps", "--all", "--filter", "label=lightshaft.farm=" + options_.worker.farm, "--format",
             "{{.Label \"lightshaft.worker\"}}|{{.State}}|{{.Label \"lightshaft.started\"}}|"
             "{{.Label \"lightshaft.cores\"}}"});
    if (!lines) return tl::unexpected(lines.error());
    auto found = parse_docker_ps(*lines, system_unix_seconds());
    if (!found) return tl::unexpected(found.error());
    for (const std::string& id : found->ended) remove(id);
    return std::move(found->workers);
  }

  Result<std::vector<std::string>> start(int count) override {
    std::vector<std::string> ids;
    for (; count > 0; --count) {
      const std::string id = new_worker_id();
      ids.push_back(id);
      auto started = run(run_command_of(id), "", kDockerRunLimit);
      if (started)
        started = run({"docker", "exec", "--interactive", container(id), "sh", "-c", kGiveToken},
                      options_.join_token + "\n");
      if (started) continue;
      remove(id);
      return tl::unexpected(started.error());
    }
    return ids;
  }

  Result<void> drain(std::span<const EngineWorker> workers) override {
    const auto drained = for_all({"docker", "kill", "--signal=TERM"}, ids_of(workers, true));
    const auto withdrawn = for_all({"docker", "rm", "--force"}, ids_of(workers, false));
    return drained ? withdrawn : drained;
  }

  Result<void> kill(std::span<const EngineWorker> workers) override {
    return for_all({"docker", "kill"}, ids_of(workers));
  }

 private:
  std::string container(const std::string& id) const {
    return "lightshaft-" + worker_name(options_.worker.farm, id);
  }

  Words run_command_of(const std::string& id) const {
    const WorkerCommand& w = options_.worker;
    Words words{"docker",
                "run",
                "--detach",
                "--init",
                "--read-only",
                "--cap-drop=ALL",
                "--security-opt=no-new-privileges",
                "--tmpfs=/tmp:mode=1777,size=256m",
                "--volume=lightshaft-cache:/cache",
                "--name=" + container(id),
                "--label=lightshaft.farm=" + w.farm,
                "--label=lightshaft.worker=" + id,
                fmt::format("--label=lightshaft.started={:.0f}", system_unix_seconds()),
                fmt::format("--label=lightshaft.cores={}", w.threads),
                fmt::format("--cpus={}", w.threads),
                fmt::format("--stop-timeout={}", options_.drain_seconds)};
    words.insert(words.end(), options_.run.begin(), options_.run.end());
    words.insert(words.end(), {"--entrypoint=sh", options_.image, "-c", kTakeToken, "sh", w.program,
                               "--coordinator", w.coordinator, "--threads", std::to_string(w.threads),
                               "--cache", "/cache", "--name", worker_name(w.farm, id)});
    words.insert(words.end(), w.options.begin(), w.options.end());
    return words;
  }

  // Removes a container after saving its log.
  void remove(const std::string& id) const {
    const auto log = run_command({"docker", "logs", container(id)}, "", kDockerLimit);
    if (log && log->code == 0)
      keep_log(options_.logs, worker_name(options_.worker.farm, id), log->out + log->err);
    run_command({"docker", "rm", "--force", container(id)}, "", kDockerLimit);
  }

  static Result<std::string> run(const Words& words, const std::string& input = "",
                                 double limit = kDockerLimit) {
    auto output = run_command(words, input, limit);
    if (!output) return tl::unexpected(output.error());
    if (output->code != 0)
      return fail(Errc::unavailable,
                  fmt::format("docker {}: {}", words[1],
                              output->err.empty()
                                  ? fmt::format("exit code {}; the container may have ended", output->code)
                                  : first_line(output->err)));
    return std::move(output->out);
  }

  // Runs a command of Docker on several containers. It is no error if some of them have ended since they were
  // listed. The command must not be repeated because of them: the other containers have received their
  // signal, and a second SIGTERM ends a worker at once.
  Result<void> for_all(Words words, const std::vector<std::string>& ids) const {
    if (ids.empty()) return {};
    for (const std::string& id : ids) words.push_back(container(id));
    const auto done = run_command(words, "", kDockerLimit);
    if (!done) return tl::unexpected(done.error());
    for (const std::string& line : split(done->err, '\n'))
      if (line.find("No such container") == std::string::npos &&
          line.find("is not running") == std::string::npos)
        return fail(Errc::unavailable, fmt::format("docker {}: {}", words[1], line));
    return {};
  }

  DockerOptions options_;
};

}  // namespace

Result<std::unique_ptr<Engine>> open_docker(DockerOptions options) {
  const auto version = run_command({"docker", "version", "--format={{.Server.Version}}"}, "", kDockerLimit);
  if (!version)
    return fail(Errc::failed_precondition, "docker does not run here: " + version.error().message);
  if (version->code != 0)
    return fail(Errc::failed_precondition, "no Docker engine answers: " + first_line(version->err));
  return std::make_unique<Docker>(std::move(options), "docker " + first_line(version->out));
}

Result<EngineList> parse_docker_ps(const std::string& lines, double unix_time) {
  EngineList found;
  for (const std::string& line : split(lines, '\n')) {
    if (line.empty()) continue;
    const std::vector<std::string> fields = split(line, '|');
    const auto started = fields.size() == 4 ? parse_number<double>(fields[2]) : std::nullopt;
    const auto cores = fields.size() == 4 ? parse_number<int>(fields[3]) : std::nullopt;
    if (!started || cores.value_or(0) < 1 || fields[0].empty())
      return bad_argument(fmt::format("docker ps answered '{}'", line));
    const std::string& state = fields[1];
    if (state == "exited" || state == "dead") {
      found.ended.push_back(fields[0]);
      continue;
    }
    // A failed `docker run` leaves a container that was created but not started.
    const bool stuck = state == "created";
    found.workers.push_back({fields[0], stuck ? State::stuck : State::running,
                             stuck ? 0 : std::max(0.0, unix_time - *started), *cores});
  }
  return found;
}

}  // namespace ls::cli
