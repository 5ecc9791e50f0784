#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <set>

#include "cli/output/reply_fields.h"
#include "cli/scale/child_command.h"
#include "cli/scale/engines.h"
#include "common/base/clock.h"
#include "common/base/parse_number.h"

namespace ls::cli {
namespace {

using nlohmann::json;
using State = EngineWorker::State;

constexpr double kKubectlLimit = 60;  // seconds allowed for one command
constexpr const char* kFarmLabel = "lightshaft.io/farm";
constexpr const char* kWorkerLabel = "lightshaft.io/worker";

std::string pod_name(const std::string& id) { return "lightshaft-worker-" + id; }

// Returns the text at a JSON pointer such as "/metadata/name"; empty if there is none.
std::string text_at(const json& object, const char* where) {
  const json::json_pointer pointer(where);
  return object.contains(pointer) && object[pointer].is_string() ? object[pointer].get<std::string>() : "";
}

// Returns the cores that the container requests ("4" or "2500m"), rounded up; 0: it requests none.
int cores_of(const json& container) {
  std::string text = text_at(container, "/resources/requests/cpu");
  const bool thousandths = text.ends_with('m');
  if (thousandths) text.pop_back();
  const auto value = parse_number<double>(text);
  return value ? static_cast<int>(std::ceil(thousandths ? *value / 1000 : *value)) : 0;
}

// Parses, for example, "2026-11-25T15:03:21Z". Returns seconds since 1970.
std::optional<double> seconds_of_utc(const std::string& text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0;
  char zone = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%2d%c", &year, &month, &day, &hour, &minute, &second,
                  &zone) != 7 ||
      zone != 'Z')
    return std::nullopt;
  const auto date = std::chrono::year(year) / month / day;
  if (!date.ok()) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  return ((days * 24.0 + hour) * 60 + minute) * 60 + second;
}

// True if a container of the pod does not start, and waiting longer will not help: its image or its
// configuration is at fault.
bool hopeless(const json& status) {
  static const std::set<std::string> reasons{"ImagePullBackOff",     "ErrImagePull",
                                             "InvalidImageName",     "CreateContainerConfigError",
                                             "CreateContainerError", "RunContainerError"};
  const auto all = status.find("containerStatuses");
  return all != status.end() && std::any_of(all->begin(), all->end(), [](const json& container) {
           return reasons.contains(text_at(container, "/state/waiting/reason"));
         });
}

Result<std::string> run_kubectl(const Words& options, const Words& words, const std::string& input = "") {
  Words all{"kubectl"};
  all.insert(all.end(), options.begin(), options.end());
  all.insert(all.end(), words.begin(), words.end());
  auto output = run_command(all, input, kKubectlLimit);
  if (!output) return tl::unexpected(output.error());
  if (output->code != 0)
    return fail(Errc::unavailable, fmt::format("kubectl {}: {}", words[0], first_line(output->err)));
  return std::move(output->out);
}

class Kubernetes final : public Engine {
 public:
  Kubernetes(KubernetesOptions options, json deployment, std::string version)
      : Engine(std::move(version)), options_(std::move(options)), deployment_(std::move(deployment)) {}

  Result<std::vector<EngineWorker>> list() override {
    const auto text =
        kubectl({"get", "pods", fmt::format("--selector={}={}", kFarmLabel, options_.farm), "--output=json"});
    if (!text) return tl::unexpected(text.error());
    auto found = parse_pods(json::parse(*text, nullptr, false), system_unix_seconds());
    if (!found) return tl::unexpected(found.error());
    for (const std::string& id : found->ended) remove_ended(id);
    return std::move(found->workers);
  }

  Result<std::vector<std::string>> start(int count) override {
    std::vector<std::string> ids;
    json pods = json::array();
    for (; count > 0; --count) {
      ids.push_back(new_worker_id());
      auto pod = pod_like(deployment_, options_, ids.back());
      if (!pod) return tl::unexpected(pod.error());
      pods.push_back(std::move(*pod));
    }
    const auto made =
        kubectl({"create", "--filename=-"},
                json{{"apiVersion", "v1"}, {"kind", "List"}, {"items", std::move(pods)}}.dump());
    if (!made) return tl::unexpected(made.error());
    return ids;
  }

  Result<void> drain(std::span<const EngineWorker> workers) override { return remove(workers, {}); }

  // Removes the pods without waiting for their nodes to confirm it, because a lost node never confirms it.
  Result<void> kill(std::span<const EngineWorker> workers) override {
    return remove(workers, {"--grace-period=0", "--force"});
  }

 private:
  static Result<void> without_text(const Result<std::string>& answer) {
    return answer ? Result<void>{} : tl::unexpected(answer.error());
  }

  Result<void> remove(std::span<const EngineWorker> workers, const Words& options) const {
    if (workers.empty()) return {};
    Words words{"delete", "pods", "--ignore-not-found", "--wait=false"};
    words.insert(words.end(), options.begin(), options.end());
    for (const auto& w : workers) words.push_back(pod_name(w.id));
    return without_text(kubectl(words));
  }

  void remove_ended(const std::string& id) const {
    if (const auto log = kubectl({"logs", pod_name(id)}))
      keep_log(options_.logs, worker_name(options_.farm, id), *log);
    kubectl({"delete", "pod", "--ignore-not-found", "--wait=false", pod_name(id)});
  }

  Result<std::string> kubectl(const Words& words, const std::string& input = "") const {
    return run_kubectl(options_.kubectl, words, input);
  }

  KubernetesOptions options_;
  json deployment_;
};

}  // namespace

Result<std::unique_ptr<Engine>> open_kubernetes(KubernetesOptions options) {
  const auto refused = [](const Error& error) { return fail(Errc::failed_precondition, error.message); };
  const auto version = run_kubectl(options.kubectl, {"version", "--output=json"});
  if (!version) return refused(version.error());
  const auto text = run_kubectl(options.kubectl, {"get", options.like, "--output=json"});
  if (!text) return refused(text.error());
  json deployment = json::parse(*text, nullptr, false);
  if (const auto pod = pod_like(deployment, options, "0"); !pod) return tl::unexpected(pod.error());
  const std::string number = text_at(json::parse(*version, nullptr, false), "/serverVersion/gitVersion");
  return std::make_unique<Kubernetes>(std::move(options), std::move(deployment), "kubernetes " + number);
}

Result<json> pod_like(const json& deployment, const KubernetesOptions& options, const std::string& id) {
  const json::json_pointer where("/spec/template"), containers("/spec/containers");
  if (!deployment.is_object() || !deployment.contains(where) || !deployment[where].contains(containers) ||
      deployment[where][containers].empty())
    return bad_argument(options.like + " has no template of a pod");
  json pod = deployment[where];
  json& worker = pod[containers][0];
  const int cores = cores_of(worker);
  if (cores != options.threads)
    return bad_argument(
        fmt::format("the pods of {} ask for {} cores: say --threads {}, or change its "
                    "resources.requests.cpu",
                    options.like, cores, std::max(cores, 1)));
  json& args = worker["args"];
  for (const std::string& word : options.worker_options) args.push_back(word);
  args.push_back("--name");
  args.push_back(worker_name(options.farm, id));
  pod["apiVersion"] = "v1";
  pod["kind"] = "Pod";
  pod["metadata"]["name"] = pod_name(id);
  pod["metadata"]["labels"][kFarmLabel] = options.farm;
  pod["metadata"]["labels"][kWorkerLabel] = id;
  // An autoscaler of nodes does not remove a node that runs a pod without a controller, such as this one,
  // unless the pod is marked as safe to evict.
  pod["metadata"]["annotations"]["cluster-autoscaler.kubernetes.io/safe-to-evict"] = "true";
  pod["spec"]["restartPolicy"] = "Never";
  pod["spec"]["terminationGracePeriodSeconds"] = options.drain_seconds;
  pod["spec"]["activeDeadlineSeconds"] = options.minutes * 60;
  return pod;
}

Result<EngineList> parse_pods(const json& list, double unix_time) {
  const json::json_pointer containers("/spec/containers/0");
  if (!list.is_object() || !list.contains("items") || !list["items"].is_array())
    return bad_argument("kubectl answered with no list of pods");
  EngineList found;
  for (const json& pod : list["items"]) {
    const std::string id = text_at(pod, "/metadata/labels/lightshaft.io~1worker");
    const std::string phase = text_at(pod, "/status/phase");
    if (id.empty() || phase.empty() || !pod.contains(containers))
      return bad_argument("kubectl answered with something else than a worker's pod");
    if (phase == "Succeeded" || phase == "Failed") {
      found.ended.push_back(id);
      continue;
    }
    EngineWorker worker{.id = id, .cores = std::max(1, cores_of(pod[containers]))};
    if (phase != "Pending")
      worker.state = State::running;
    else if (hopeless(pod["status"]))
      worker.state = State::stuck;
    if (const auto since = seconds_of_utc(text_at(pod, "/status/startTime")))
      worker.seconds = std::max(0.0, unix_time - *since);
    found.workers.push_back(worker);
  }
  return found;
}

}  // namespace ls::cli
