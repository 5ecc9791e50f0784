// Runs workers as pods of Kubernetes: kubectl starts, lists, drains and ends them. A pod is made from the
// template in a Deployment of the cluster, so that image, secrets, TLS and security settings are given in one
// place, the Deployment's manifest.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>

#include "cli/scale/engine.h"

namespace ls::cli {

struct KubernetesOptions {
  std::string farm;
  std::string like = "deployment/worker";  // the Deployment whose template the pods get
  int threads = 1;                         // cores that the template must request
  int drain_seconds = 120;  // the pods' grace period: time that a worker has to deliver its results and end
  int minutes = 60;         // time limit, after which Kubernetes ends the pod, with that grace period
  std::string logs = ".";   // folder for the logs of workers that have ended
  std::vector<std::string> kubectl;         // more options of kubectl, one word each
  std::vector<std::string> worker_options;  // more options of the worker
};

// `unix_time` returns the seconds since 1970. failed_precondition: kubectl does not reach a cluster, or the
// cluster has no such Deployment. invalid_argument: the Deployment's pods do not request `threads` cores.
Result<std::unique_ptr<Engine>> open_kubernetes(KubernetesOptions options, std::function<double()> unix_time);

// Returns the pod of a new worker, made from the template in `deployment`, which `kubectl get -o json` has
// printed. invalid_argument: there is no template, or it does not request `options.threads` cores.
Result<nlohmann::json> pod_like(const nlohmann::json& deployment, const KubernetesOptions& options,
                                const std::string& id);

struct KubernetesPods {
  std::vector<EngineWorker> workers;
  std::vector<std::string> ended;  // ids of workers whose pods have ended
};
// Reads the output of `kubectl get pods -o json`. invalid_argument: it is not a list of pods that were made
// by pod_like().
Result<KubernetesPods> parse_pods(const nlohmann::json& list, double unix_time);

}  // namespace ls::cli
