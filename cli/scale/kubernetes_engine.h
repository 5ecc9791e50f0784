// Workers as pods of Kubernetes: kubectl starts, lists, drains and ends them. They are pods as a Deployment
// there describes them, so that image, secrets, TLS and confinement are said in one place, the manifests.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>

#include "cli/scale/engine.h"

namespace ls::cli {

struct KubernetesOptions {
  std::string farm;
  std::string like = "deployment/worker";   // whose template the pods have
  int threads = 1;                          // that the template asks for
  int drain_seconds = 120;                  // the pods' grace period
  int minutes = 60;                         // until Kubernetes ends a worker, with that grace period
  std::string logs = ".";                   // folder for the logs of workers that have ended
  std::vector<std::string> kubectl;         // more options of kubectl, one word each
  std::vector<std::string> worker_options;  // more options of the worker
};

// `unix_time`: seconds since 1970. failed_precondition: kubectl does not reach a cluster, or there is no such
// Deployment there. invalid_argument: its pods do not ask for `threads` cores.
Result<std::unique_ptr<Engine>> open_kubernetes(KubernetesOptions options, std::function<double()> unix_time);

// The pod of a worker, of the Deployment that `kubectl get -o json` printed. invalid_argument: the Deployment
// has no container that asks for `options.threads` cores.
Result<nlohmann::json> pod_like(const nlohmann::json& deployment, const KubernetesOptions& options,
                                const std::string& id);

struct KubernetesPods {
  std::vector<EngineWorker> workers;
  std::vector<std::string> ended;  // ids
};
// Reads what `kubectl get pods -o json` printed. invalid_argument: it is no list of pods of a farm-up.
Result<KubernetesPods> parse_pods(const nlohmann::json& list, double unix_time);

}  // namespace ls::cli
