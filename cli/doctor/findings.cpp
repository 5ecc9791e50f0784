#include "cli/doctor/findings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "cli/farm/tcp.h"
#include "cli/output/console.h"
#include "core/base/safe_text.h"
#include "core/scene/limits.h"
#include "worker/machine.h"

namespace ls::cli {
namespace {

// Memory below this causes a warning: denoising an image takes up to 2 GiB, the limit that lightshaft-denoise
// sets itself.
constexpr std::uint64_t kLittleMemory = std::uint64_t{2} << 30;
// Free disk space below kNoRoom is a problem, and below kLittleRoom causes a warning. A coordinator stores
// each scene twice, as XML and in canonical form, so a disk with less than twice the size of the largest XML
// may not hold even a scene without other files. The OpenVDB file of a cloud has hundreds of MiB, so a few of
// them fill 1 GiB.
constexpr std::uint64_t kNoRoom = 2 * scene::kMaxTextBytes, kLittleRoom = std::uint64_t{1} << 30;
// Differences between clocks, in seconds. Receivers of webhooks reject signatures that are several minutes
// old (docs/guide/operations.md), so a difference of up to a minute does no harm. S3 rejects requests whose
// time differs by more than 15 minutes.
constexpr double kClockWarning = 60, kClockProblem = 900;
constexpr std::size_t kNamesShown = 5;

Finding ok(std::string name, std::string what) {
  return {std::move(name), {}, Status::ok, std::move(what), {}};
}

Finding warning(std::string name, std::string what, std::string advice) {
  return {std::move(name), {}, Status::warning, std::move(what), std::move(advice)};
}

Finding problem(std::string name, std::string what, std::string advice) {
  return {std::move(name), {}, Status::problem, std::move(what), std::move(advice)};
}

Finding of_memory(const MachineFacts& facts) {
  const std::string what = show_bytes(facts.memory_bytes) + " for this process";
  if (facts.memory_bytes >= kLittleMemory) return ok("memory", what);
  return warning("memory", what + ": large scenes and denoising need more than " + show_bytes(kLittleMemory),
                 "raise the limit of the control group or container, or use a machine with more memory");
}

Finding of_cores(const MachineFacts& facts) {
  const std::string what = fmt::format("{} usable", facts.cpus);
  if (!(facts.cpu_quota > 0 && facts.cpu_quota < facts.cpus)) return ok("cores", what);
  return warning("cores",
                 what + fmt::format(", but the control group grants the time of {:.3g}", facts.cpu_quota),
                 fmt::format("start renders and workers with --threads {}",
                             std::max(1, static_cast<int>(std::lround(facts.cpu_quota)))));
}

Finding of_file_limit(const MachineFacts& facts) {
  const std::string what = fmt::format("up to {}", facts.file_limit);
  if (facts.file_limit >= worker::kWantedFiles) return ok("open-files", what);
  return warning("open-files",
                 what + fmt::format(": a worker wants {}, one for each file in use", worker::kWantedFiles),
                 fmt::format("raise the hard limit: ulimit -Hn {0}, or LimitNOFILE={0} in the unit",
                             worker::kWantedFiles));
}

Finding of_sandbox(const MachineFacts& facts) {
  if (!facts.sandbox)
    return warning("sandbox", "it could not be tried: this program cannot start itself",
                   "check that /proc is mounted");
  std::vector<std::string> missing;
  if (!facts.sandbox->calls) missing.emplace_back("opening sockets (seccomp)");
  if (!facts.sandbox->files) missing.emplace_back("files that are not a scene's (Landlock)");
  if (missing.empty()) return ok("sandbox", "the kernel confines the rendering process of a worker");
  return warning("sandbox",
                 fmt::format("the kernel cannot keep a worker's rendering process from {}",
                             fmt::join(missing, ", nor from ")),
                 "use Linux 5.13 or later with Landlock, or render trusted scenes only");
}

Finding of_python(const PythonFacts& facts) {
  if (facts.interpreter.empty())
    return warning(
        "python", "there is no python3 in PATH",
        "only `lightshaft up`, `join`, `farm up` and `compare` need it: install Python 3.11 or later");
  if (facts.part.empty())
    return warning("python", "lightshaft_command, a part of this program, is not where it should be",
                   "only `lightshaft up`, `join`, `farm up` and `compare` need it: install Lightshaft again");
  if (facts.makes_scene && !facts.numpy)
    return warning("python", fmt::format("{} has no NumPy", facts.interpreter.string()),
                   "only the first picture of `lightshaft up` needs it: install python3-numpy, or let "
                   "LIGHTSHAFT_PYTHON name a Python that has it");
  return ok("python", facts.interpreter.string());
}

Finding of_folder(const FolderFacts& folder) {
  Finding found{folder.name,
                folder.path.string(),
                Status::ok,
                fmt::format("may be written, {} free", show_bytes(folder.free_bytes)),
                {}};
  if (!folder.usable) {
    found.status = Status::problem;
    found.what = "is no folder that this user may write to";
    found.advice = "change its owner or permissions, or choose another folder";
  } else if (folder.free_bytes < kLittleRoom) {
    found.status = folder.free_bytes < kNoRoom ? Status::problem : Status::warning;
    found.what = fmt::format("has only {} free", show_bytes(folder.free_bytes));
    found.advice = "make room on its disk, or choose another folder";
  }
  return found;
}

bool on_this_machine(const std::string& url) { return is_loopback(host_of(url)); }

std::string through(const std::string& proxy) { return proxy.empty() ? "" : ", through the proxy " + proxy; }

Finding of_reachability(const FarmFacts& facts) {
  if (!facts.trouble.empty()) {
    const bool tls = facts.trouble.find("SSL") != std::string::npos ||
                     facts.trouble.find("certificate") != std::string::npos;
    return problem(
        "farm", facts.trouble,
        tls ? "name the file of the farm's authority with --ca or LIGHTSHAFT_CA (ca.pem, in the "
              "coordinator's DATA/tls), and check that the address is one that its certificate names"
            : "check the address, that the coordinator runs, and that no firewall blocks its port");
  }
  if (!facts.is_coordinator)
    return problem("farm", "something other than a coordinator answers there" + through(facts.proxy),
                   facts.proxy.empty()
                       ? "check the address and port: it is the coordinator's --http"
                       : "name the farm's host in no_proxy, or check the address and port: it is the "
                         "coordinator's --http");
  if (!facts.not_ready.empty())
    return problem("farm", facts.not_ready, "see the coordinator's log; its disk may be full");
  if (!facts.remark.empty()) return warning("farm", facts.remark, "see the coordinator's log");
  return ok("farm", "reachable and ready" + through(facts.proxy));
}

Finding of_tls(const FarmFacts& facts) {
  if (facts.url.starts_with("https:")) return ok("tls", "encrypted, and its certificate is trusted");
  if (on_this_machine(facts.url)) return ok("tls", "not encrypted, but on this machine");
  return warning("tls", "not encrypted: anyone on the network between can read the token",
                 "start the coordinator with --tls, and use its https address");
}

Finding of_clock(const FarmFacts& facts) {
  if (!facts.date)
    return warning("clock", "the answer has no header Date, so the clocks were not compared",
                   "check whether a proxy removes it");
  const double lead = clock_lead(facts.asked_at, facts.answered_at, *facts.date);
  if (std::abs(lead) <= kClockWarning)
    return ok("clock", lead == 0 ? std::string("agrees with this machine's")
                                 : fmt::format("differs from this machine's by {}, within {}",
                                               show_seconds(std::abs(lead)), show_seconds(kClockWarning)));
  return {"clock",
          {},
          std::abs(lead) > kClockProblem ? Status::problem : Status::warning,
          fmt::format("the coordinator's is at least {} {} this machine's: webhooks and requests to S3 may "
                      "be refused",
                      show_seconds(std::abs(lead)), lead > 0 ? "ahead of" : "behind"),
          "set both machines' clocks by NTP (timedatectl set-ntp true)"};
}

Finding of_token(const FarmFacts& facts) {
  if (!facts.has_token)
    return problem("token", "none is given, so the farm answers no requests",
                   "give --token-file FILE or LIGHTSHAFT_TOKEN; `lightshaft token add` makes one");
  if (!facts.role.empty())
    return ok("token", facts.user.empty() ? fmt::format("valid, role {}", facts.role)
                                          : fmt::format("valid, role {}, user {}", facts.role, facts.user));
  if (facts.session_status == 401)
    return problem(
        "token", "the farm does not know it",
        "check the file or LIGHTSHAFT_TOKEN; the farm's admin can make another: lightshaft token add");
  return problem("token", facts.session_trouble.empty() ? "no answer" : facts.session_trouble,
                 facts.session_status == 403 ? "use a token of the role submit, read or admin"
                                             : "try again, and see the coordinator's log");
}

Finding of_version(const FarmFacts& facts, const std::string& program_version) {
  if (facts.version == program_version)
    return ok("version", fmt::format("coordinator and this command are {}", program_version));
  const std::string coordinator = facts.version.empty() ? "does not tell its version" : "is " + facts.version;
  return warning("version",
                 fmt::format("the coordinator {}, this command is {}", coordinator, program_version),
                 "install the same version everywhere");
}

Finding of_workers_port(const FarmFacts& facts) {
  const auto address = parse_host_port(facts.workers_address);
  if (address && is_loopback(address->host) && !on_this_machine(facts.url))
    return ok("workers-port", fmt::format("the coordinator takes workers of its own machine alone ({})",
                                          facts.workers_address));
  if (facts.workers_trouble.empty())
    return ok("workers-port", fmt::format("{} can be reached", facts.workers_address));
  return warning(
      "workers-port",
      fmt::format("{}, where the coordinator takes workers, cannot be reached: {}", facts.workers_address,
                  facts.workers_trouble),
      fmt::format("only a worker of this machine needs it: let port {} pass the farm's firewall, or "
                  "give the coordinator --public-grpc HOST:PORT, as other machines reach it",
                  address ? address->port : ""));
}

std::string list(const std::set<std::string>& names) {
  std::vector<std::string> shown(names.begin(), names.end());
  const std::size_t more = shown.size() > kNamesShown ? shown.size() - kNamesShown : 0;
  shown.resize(shown.size() - more);
  return more ? fmt::format("{} and {} more", fmt::join(shown, ", "), more)
              : fmt::format("{}", fmt::join(shown, ", "));
}

// Adds a finding about the workers for which `wrong` is true, if there are any.
template <class Wrong>
void add_if_any(std::vector<Finding>& all, const std::vector<WorkerFacts>& workers, Wrong wrong,
                const std::string& name, const std::string& what, const std::string& advice) {
  std::set<std::string> names;
  for (const WorkerFacts& worker : workers)
    if (wrong(worker)) names.insert(worker.name);
  if (!names.empty()) all.push_back(warning(name, what + ": " + list(names), advice));
}

void add_workers(std::vector<Finding>& all, const FarmFacts& facts, const std::string& numeric_class) {
  std::vector<WorkerFacts> present;
  for (const WorkerFacts& worker : *facts.workers)
    if (worker.state != "lost" && worker.state != "gone") present.push_back(worker);
  if (present.empty()) {
    all.push_back(warning("workers", "none is connected, so no job can make progress",
                          "start lightshaft-worker with this coordinator's address for workers (--grpc)"));
    return;
  }
  const std::size_t before = all.size();
  add_if_any(
      all, present, [](const WorkerFacts& w) { return w.state == "sick"; }, "workers",
      "unhealthy or quarantined", "see their activity: lightshaft workers");
  add_if_any(
      all, present, [](const WorkerFacts& w) { return w.fake; }, "workers",
      "they invent pixels (--fake) instead of rendering", "stop them on a farm that renders");
  if (before == all.size()) all.push_back(ok("workers", fmt::format("{} connected", present.size())));
  if (!facts.version.empty())
    add_if_any(
        all, present, [&](const WorkerFacts& w) { return w.version != facts.version; }, "worker-versions",
        "of another version than the coordinator, " + facts.version,
        "install the coordinator's version on them");
  std::set<std::string> classes;
  for (const WorkerFacts& worker : present)
    if (!worker.fake) classes.insert(worker.numeric_class);
  if (classes.size() > 1)
    all.push_back(warning(
        "numeric-class",
        fmt::format("the workers are of {} numeric classes, and each job uses one of them", classes.size()),
        "give all workers the same build"));
  else if (!classes.empty() && !classes.contains(numeric_class))
    all.push_back(
        warning("numeric-class",
                "the workers are of another numeric class than this machine: `lightshaft render` gives "
                "other bits than the farm",
                "install the workers' build here, if equal bits matter"));
  else if (!classes.empty())
    all.push_back(ok("numeric-class", "the workers render the same bits as this machine"));
}

Finding of_jobs(const std::vector<StuckJob>& stuck) {
  if (stuck.empty()) return ok("jobs", "no unfinished job is stuck");
  const StuckJob& first = stuck.front();
  return warning("jobs",
                 fmt::format("{} no progress; {}: {}",
                             stuck.size() == 1 ? "1 unfinished job makes"
                                               : fmt::format("{} unfinished jobs make", stuck.size()),
                             first.id, first.why),
                 fmt::format("lightshaft show {}", shell_word(first.id)));
}

}  // namespace

std::string to_string(Status status) {
  return status == Status::ok ? "ok" : status == Status::warning ? "warning" : "problem";
}

Status worst(const std::vector<Finding>& findings) {
  Status status = Status::ok;
  for (const Finding& each : findings) status = std::max(status, each.status);
  return status;
}

std::vector<Finding> judge_machine(const MachineFacts& facts) {
  std::vector<Finding> all{
      facts.processor_fits
          ? ok("processor", fmt::format("has what this build needs ({}); numeric class {:.12}",
                                        facts.processor_target, facts.numeric_class))
          : problem("processor",
                    fmt::format("lacks instructions that this build needs ({})", facts.processor_target),
                    "use a newer machine, or build with another LIGHTSHAFT_ARCH on all machines"),
      of_memory(facts),
      of_cores(facts),
      of_file_limit(facts),
      of_sandbox(facts),
      facts.vdb_found ? ok("openvdb", facts.vdb_program.string())
                      : problem("openvdb",
                                fmt::format("{} is missing: .vdb and .nvdb files cannot be read",
                                            facts.vdb_program.string()),
                                "install the package lightshaft-vdb, or build the target lightshaft-vdb"),
      !facts.denoiser.empty()
          ? ok("denoiser", facts.denoiser)
          : warning("denoiser", facts.denoiser_trouble,
                    "only --denoise needs it: pip install pyoidn beside the wheel, or run "
                    "deploy/install-denoiser.sh"),
      ok("redis", facts.redis_server.empty()
                      ? "no redis-server in PATH; only a coordinator with --store redis:// needs one, on any "
                        "machine"
                      : facts.redis_server.string()),
      of_python(facts.python)};
  for (const FolderFacts& folder : facts.folders) all.push_back(of_folder(folder));
  return all;
}

double clock_lead(double asked_at, double answered_at, std::int64_t date) {
  // When the coordinator wrote the date, its clock was in [date, date + 1), and this machine's in
  // [asked_at, answered_at]. So the difference of the clocks is in [least, most).
  const double least = static_cast<double>(date) - answered_at;
  const double most = static_cast<double>(date) + 1 - asked_at;
  return least > 0 ? least : most < 0 ? most : 0;
}

Finding judge_joining(const JoiningFacts& facts) {
  Finding found{"joining-port", facts.address, Status::ok, "can be reached", {}};
  if (!facts.trouble.empty()) {
    found.status = Status::problem;
    found.what = "cannot be reached: " + facts.trouble;
    found.advice =
        "check that `lightshaft up --lan` runs there and names this port for joining, and that its firewall "
        "lets the port pass";
  }
  return found;
}

std::vector<Finding> judge_farm(const FarmFacts& facts, const std::string& program_version,
                                const std::string& numeric_class) {
  std::vector<Finding> all{of_reachability(facts)};
  if (facts.is_coordinator) {
    all.push_back(of_tls(facts));
    all.push_back(of_clock(facts));
    all.push_back(of_token(facts));
    if (!facts.role.empty()) all.push_back(of_version(facts, program_version));
    if (!facts.workers_address.empty()) all.push_back(of_workers_port(facts));
    if (facts.workers) add_workers(all, facts, numeric_class);
    if (facts.stuck_jobs) all.push_back(of_jobs(*facts.stuck_jobs));
  }
  for (Finding& each : all) each.subject = facts.url;
  return all;
}

}  // namespace ls::cli
