#include "cli/doctor/facts.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "cli/farm/farm_api.h"
#include "cli/farm/tcp.h"
#include "cli/output/reply_fields.h"
#include "core/base/clock.h"
#include "core/base/machine_memory.h"
#include "core/base/spawn.h"
#include "util/denoise/denoiser.h"
#include "worker/machine.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

enum ProbeBits : int { kProbed = 64, kCalls = 1, kFiles = 2 };

std::optional<Sandboxed> probe_sandbox() {
  const Descriptor nothing(::open("/dev/null", O_RDWR | O_CLOEXEC));
  if (nothing.fd < 0) return std::nullopt;
  const auto end = run_helper("/proc/self/exe", {kSandboxProbeFlag}, nothing.fd);
  if (!end || !WIFEXITED(end->status) || !(WEXITSTATUS(end->status) & kProbed)) return std::nullopt;
  const int bits = WEXITSTATUS(end->status);
  return Sandboxed{(bits & kCalls) != 0, (bits & kFiles) != 0};
}

bool processor_fits([[maybe_unused]] const std::string& target) {
  // Any other target counts as supported, because this program, which was compiled for it, runs.
#ifdef __x86_64__
  if (target == "x86-64-v3") return __builtin_cpu_supports("x86-64-v3") != 0;
#endif
  return true;
}

double cpu_quota() {
  double quota = 0, period = 0;
  std::ifstream group("/sys/fs/cgroup/cpu.max");
  // Without a limit the file has "max" in place of the quota, and reading a number fails.
  return group >> quota >> period && period > 0 ? quota / period : 0;
}

bool may_run(const fs::path& program) { return ::access(program.c_str(), X_OK) == 0; }

fs::path in_path(const std::string& program) {
  const char* variable = std::getenv("PATH");
  const std::string folders = variable ? variable : "";
  for (std::size_t at = 0; at < folders.size();) {
    const std::size_t end = std::min(folders.find(':', at), folders.size());
    const fs::path candidate = fs::path(folders.substr(at, end - at)) / program;
    if (may_run(candidate)) return candidate;
    at = end + 1;
  }
  return {};
}

// Returns true if the interpreter finds NumPy when it is started as python_commands.cpp starts it.
bool finds_numpy(const fs::path& interpreter) {
  const char* of_wheel = std::getenv("LIGHTSHAFT_PYTHON");
  std::vector<std::string> words{interpreter.string()};
  if (!of_wheel || !*of_wheel) words.insert(words.end(), {"-E", "-s"});
  words.insert(words.end(),
               {"-B", "-c", "import importlib.util as u, sys; sys.exit(u.find_spec('numpy') is None)"});
  const auto started = spawn({.path = interpreter.string(),
                              .arguments = std::move(words),
                              .files = {kDevNull, kDevNull, kDevNull},
                              .inherits = [](std::string_view) { return true; }});
  if (!started) return false;
  const int status = wait_for_end(*started);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

PythonFacts observe_python() {
  PythonFacts facts = find_python();
  if (facts.interpreter.empty() || facts.part.empty()) return facts;
  facts.numpy = finds_numpy(facts.interpreter);
  facts.makes_scene = !fs::exists(facts.part / "bath" / "bath.xml") &&
                      fs::exists(facts.part / "../../../scenes/bath/make_bath.py");
  return facts;
}

// Observes a folder. If it does not exist, observes the nearest existing folder above it, in which it would
// be created.
FolderFacts observe_folder(const std::string& name, const fs::path& path) {
  FolderFacts facts{name, path, false, 0};
  std::error_code error;
  fs::path existing = fs::absolute(path, error);
  while (!existing.empty() && existing != existing.root_path() && !fs::exists(existing, error))
    existing = existing.parent_path();
  facts.usable = fs::is_directory(existing, error) && ::access(existing.c_str(), W_OK | X_OK) == 0;
  const auto space = fs::space(existing, error);
  if (!error) facts.free_bytes = space.available;
  return facts;
}

// Removes user and password: "https://user:password@host" becomes "https://host".
std::string without_password(const std::string& url) {
  const std::size_t start = url.find("://");
  const std::size_t host = start == std::string::npos ? 0 : start + 3;
  const std::size_t end = std::min(url.find('/', host), url.size());
  const std::size_t at = url.substr(0, end).rfind('@');
  return at == std::string::npos || at < host ? url : url.substr(0, host) + url.substr(at + 1);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

std::vector<WorkerFacts> workers_of(const json& answer) {
  std::vector<WorkerFacts> all;
  for (const json& w : objects_field(answer, "workers"))
    all.push_back({text_field(w, "name"), text_field(w, "state"), text_field(w, "build"),
                   text_field(w, "numeric_class"), flag_field(w, "fake")});
  return all;
}

// The newest jobs are asked for: a person looks for what they have submitted.
constexpr const char* kOpenJobs = "/api/v1/jobs?state=queued,running,paused&sort=-submitted&limit=50";

std::vector<StuckJob> stuck_jobs_of(const json& answer) {
  std::vector<StuckJob> stuck;
  for (const json& job : objects_field(answer, "jobs"))
    if (std::string why = text_field(job, "error"); !why.empty())
      stuck.push_back({text_field(job, "id"), std::move(why)});
  return stuck;
}

void ask_readiness(HttpClient& client, FarmFacts& facts) {
  const auto ready = client.request("GET", "/readyz");
  if (!ready) {
    facts.not_ready = ready.error().message;
  } else if (ready->status / 100 != 2) {
    facts.not_ready = problem_of(*ready).error.message;
  } else if (ready->body != "ready\n") {
    facts.remark = ready->body.substr(0, ready->body.find('\n'));
  }
}

// Connects to the address at which the coordinator says that it takes workers, as a worker of this machine
// would. A port of the coordinator's own machine alone cannot be tried from another one.
void try_workers_port(const json& answer, const std::string& url, FarmFacts& facts) {
  const json* join = object_field(answer, "join");
  const std::string named = join ? text_field(*join, "address") : "";
  auto address = parse_host_port(named);
  if (!address) return;
  if (address->host == "0.0.0.0" || address->host == "::" || address->host == "*")
    address->host = host_of(url);
  facts.workers_address = host_port_text(*address);
  if (is_loopback(address->host) && !is_loopback(host_of(url))) return;
  if (const auto connected = TcpConnection::open(*address); !connected)
    facts.workers_trouble = connected.error().message;
}

void ask_session(HttpClient& client, const std::string& url, FarmFacts& facts) {
  const auto session = client.request("GET", "/api/v1/session");
  if (!session) {
    facts.session_trouble = session.error().message;
    return;
  }
  facts.session_status = session->status;
  const json answer = json::parse(session->body, nullptr, false);
  if (session->status / 100 != 2 || !answer.is_object()) {
    facts.session_trouble = problem_of(*session).error.message;
    return;
  }
  facts.role = text_field(answer, "role");
  facts.user = text_field(answer, "user");
  facts.version = text_field(answer, "version");
  const auto workers = client.request("GET", "/api/v1/workers");
  if (!workers || workers->status / 100 != 2) return;
  if (const json list = json::parse(workers->body, nullptr, false); list.is_object()) {
    facts.workers = workers_of(list);
    try_workers_port(list, url, facts);
  }
  const auto jobs = client.request("GET", kOpenJobs);
  if (!jobs || jobs->status / 100 != 2) return;
  if (const json list = json::parse(jobs->body, nullptr, false); list.is_object())
    facts.stuck_jobs = stuck_jobs_of(list);
}

Result<FarmFacts> observe_one(const HttpClient::Options& connection) {
  auto client = HttpClient::open(connection);
  if (!client) return tl::unexpected(client.error());
  FarmFacts facts;
  facts.has_token = !connection.token.empty();
  facts.asked_at = system_unix_seconds();
  const auto health = client->request("GET", "/healthz");
  facts.answered_at = system_unix_seconds();
  if (!health) {
    facts.trouble = health.error().message;
    return facts;
  }
  facts.date = health->date;
  facts.proxy = health->proxy;
  facts.is_coordinator = health->status == 200 && health->body == "ok\n";
  if (!facts.is_coordinator) return facts;
  ask_readiness(*client, facts);
  if (facts.has_token) ask_session(*client, without_password(connection.url), facts);
  return facts;
}

}  // namespace

int run_sandbox_probe() {
  const auto held = enter_sandbox({});
  return kProbed | (held.calls ? kCalls : 0) | (held.files ? kFiles : 0);
}

PythonFacts find_python() {
  PythonFacts facts;
  const char* of_wheel = std::getenv("LIGHTSHAFT_PYTHON");
  facts.interpreter = of_wheel && *of_wheel ? of_wheel : in_path("python3");
  // Where `cmake --install` puts it, in a wheel, and in a build. That of a build comes last: beside a package
  // that is unpacked somewhere it is a folder of others.
  for (const char* folder : {"../../share/lightshaft/lightshaft_command", "../../../lightshaft_command",
                             "../../../python/src/lightshaft_command"}) {
    const fs::path part = program_beside_us(folder).lexically_normal();
    if (facts.part.empty() && fs::exists(part / "__main__.py")) facts.part = part;
  }
  return facts;
}

MachineFacts observe_machine(const fs::path& cache, const fs::path& data) {
  MachineFacts facts;
  facts.processor_target = LIGHTSHAFT_ARCH;
  facts.processor_fits = processor_fits(facts.processor_target);
  facts.numeric_class = render::numeric_class().hex();
  facts.memory_bytes = usable_memory_bytes();
  facts.cpus = worker::usable_cpus();
  facts.cpu_quota = cpu_quota();
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) == 0) facts.file_limit = files.rlim_max;
  facts.sandbox = probe_sandbox();
  facts.vdb_program = program_beside_us("lightshaft-vdb");
  facts.vdb_found = may_run(facts.vdb_program);
  const auto denoiser = Denoiser::find(1);
  if (denoiser) facts.denoiser = denoiser->name();
  if (!denoiser) facts.denoiser_trouble = denoiser.error().message;
  facts.redis_server = in_path("redis-server");
  facts.python = observe_python();
  facts.folders.push_back(observe_folder("cache", cache.empty() ? worker::default_cache() : cache));
  if (!data.empty()) facts.folders.push_back(observe_folder("data", data));
  return facts;
}

Result<std::vector<FarmFacts>> observe_farm(const HttpClient::Options& connection) {
  std::vector<FarmFacts> all;
  HttpClient::Options one = connection;
  for (const std::string& url : addresses_in(connection.url, !connection.ca.empty())) {
    one.url = url;
    const std::string shown = without_password(url);
    auto facts = observe_one(one);
    if (!facts) return fail(facts.error().code, replaced(facts.error().message, url, shown));
    facts->url = shown;
    for (std::string* text : {&facts->trouble, &facts->not_ready, &facts->session_trouble})
      *text = replaced(*text, url, shown);
    all.push_back(std::move(*facts));
  }
  return all;
}

Result<JoiningFacts> observe_joining(const std::string& address) {
  const auto peer = parse_host_port(address);
  if (!peer) return fail(Errc::invalid_argument, "--join " + peer.error().message);
  JoiningFacts facts{host_port_text(*peer), {}};
  if (const auto connected = TcpConnection::open(*peer); !connected)
    facts.trouble = connected.error().message;
  return facts;
}

}  // namespace ls::cli
