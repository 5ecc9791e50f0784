#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "cli/scale/child_command.h"
#include "cli/scale/engines.h"
#include "common/base/clock.h"

namespace ls::cli {
namespace {

// The script that runs on the machine, the same for every worker. From standard input it reads the worker's
// command line, one word on each line up to an empty line, and then the token. So no shell parses the words,
// and no list of processes shows the token. When standard input ends, because `farm up` closed it or the
// connection broke, the script signals the worker to deliver its results and end.
constexpr const char* kRemote =
    R"(sh -c 'set --
while IFS= read -r word && [ -n "$word" ]; do set -- "$@" "$word"; done
IFS= read -r LIGHTSHAFT_JOIN_TOKEN
export LIGHTSHAFT_JOIN_TOKEN
exec 3<&0
"$@" </dev/null 3<&- & worker=$!
(while read -r word; do :; done; kill -TERM "$worker") <&3 >/dev/null 2>&1 & reader=$!
exec 3<&-
wait "$worker"; code=$?
kill "$reader" 2>/dev/null
exit "$code"')";

class Ssh final : public Engine {
 public:
  Ssh(SshOptions options, std::string version) : Engine(std::move(version)), options_(std::move(options)) {}

  Result<std::vector<EngineWorker>> list() override {
    std::vector<EngineWorker> workers;
    for (auto it = running_.begin(); it != running_.end();) {
      if (it->second.ssh.ended()) {
        it = running_.erase(it);
        continue;
      }
      workers.push_back({it->second.id, EngineWorker::State::running,
                         seconds(clock_.now() - it->second.since), options_.worker.threads});
      ++it;
    }
    return workers;
  }

  // Tries the machines in turn, so that one that is down does not get every attempt.
  Result<std::vector<std::string>> start(int count) override {
    std::vector<std::string> ids;
    for (std::size_t tried = 0; count > 0 && tried < options_.machines.size(); ++tried) {
      const std::string& machine = options_.machines[next_++ % options_.machines.size()];
      if (running_.contains(machine)) continue;
      if (const auto started = start_on(machine); !started) return tl::unexpected(started.error());
      ids.push_back(running_.at(machine).id);
      --count;
    }
    return ids;
  }

  Result<void> drain(std::span<const EngineWorker> workers) override {
    for (const auto& w : workers)
      if (Running* running = find(w.id)) running->ssh.close_input();
    return {};
  }

  Result<void> kill(std::span<const EngineWorker> workers) override {
    for (const auto& w : workers)
      if (Running* running = find(w.id)) running->ssh.kill();
    return {};
  }

 private:
  struct Running {
    std::string id;
    LongCommand ssh;
    TimePoint since;
  };

  Running* find(const std::string& id) {
    const auto it =
        std::find_if(running_.begin(), running_.end(), [&](auto& r) { return r.second.id == id; });
    return it == running_.end() ? nullptr : &it->second;
  }

  Result<void> start_on(const std::string& machine) {
    const WorkerCommand& w = options_.worker;
    const std::string id = fmt::format("{}-{}", machine, ++count_);
    Words words{
        "ssh", "-T", "-o", "BatchMode=yes", "-o", "ConnectTimeout=15", "-o", "ServerAliveInterval=15"};
    if (!options_.config.empty()) words.insert(words.end(), {"-F", options_.config});
    words.insert(words.end(), {"--", machine, kRemote});
    Words remote{w.program,   "--coordinator",          w.coordinator, "--name", worker_name(w.farm, id),
                 "--threads", std::to_string(w.threads)};
    remote.insert(remote.end(), w.options.begin(), w.options.end());
    std::string input;
    for (const std::string& word : remote) {
      if (word.empty() || word.find('\n') != std::string::npos)
        return bad_argument(fmt::format("'{}' cannot be a word of a worker's command over ssh", word));
      input += word + "\n";
    }
    input += "\n" + options_.join_token + "\n";
    auto ssh = LongCommand::start(words, input,
                                  fmt::format("{}/{}.log", options_.logs, worker_name(w.farm, machine)));
    if (!ssh) return tl::unexpected(ssh.error());
    running_.emplace(machine, Running{id, std::move(*ssh), clock_.now()});
    return {};
  }

  SshOptions options_;
  const SystemClock clock_;
  std::map<std::string, Running> running_;  // the running worker of each machine, by machine
  std::size_t next_ = 0;
  int count_ = 0;
};

bool plain_machine(const std::string& name) {
  return !name.empty() && name.front() != '-' && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) ||
           std::string_view("@.-_:[]%").find(static_cast<char>(c)) != std::string_view::npos;
  });
}

}  // namespace

Result<std::unique_ptr<Engine>> open_ssh(SshOptions options) {
  const auto version = run_command({"ssh", "-V"}, "", 10);
  if (!version || version->code != 0)
    return fail(Errc::failed_precondition, "ssh does not run here: install an OpenSSH client");
  return std::make_unique<Ssh>(std::move(options), version->err.substr(0, version->err.find_first_of(",\n")));
}

Result<std::vector<std::string>> read_machines(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return bad_argument(fmt::format("{}: cannot be read", file.string()));
  std::vector<std::string> machines;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    line.resize(std::min(line.size(), line.find('#')));
    const auto begin = line.find_first_not_of(" \t\r"), end = line.find_last_not_of(" \t\r");
    if (begin == std::string::npos) continue;
    const std::string name = line.substr(begin, end + 1 - begin);
    const bool again = std::find(machines.begin(), machines.end(), name) != machines.end();
    if (!plain_machine(name) || again)
      return bad_argument(
          fmt::format("{}:{}: error: '{}' {}", file.string(), number, name,
                      again ? "is named twice" : "is no machine's name: HOST or USER@HOST, one a line"));
    machines.push_back(name);
  }
  if (machines.empty()) return bad_argument(fmt::format("{}: names no machines", file.string()));
  return machines;
}

}  // namespace ls::cli
