// The engines that `lightshaft farm up` can use. To *drain* a worker is to ask it to deliver its results and
// end.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/scale/engine.h"

namespace ls::cli {

struct EngineList {
  std::vector<EngineWorker> workers;
  std::vector<std::string> ended;  // ids of workers that have ended, but are not removed yet
};

// Slurm: workers are jobs. sbatch starts them as an array, squeue lists them, scancel drains and stops them.
struct SlurmOptions {
  WorkerCommand worker;
  int minutes = 60;                 // time limit of a worker's job, in minutes
  int drain_seconds = 120;          // how long before the time limit Slurm signals the worker to drain
  std::string logs = ".";           // folder for the workers' logs
  std::vector<std::string> sbatch;  // more options of sbatch, one word each
};

// failed_precondition: Slurm's commands are not installed.
Result<std::unique_ptr<Engine>> open_slurm(SlurmOptions options);

// Parses the output of squeue. invalid_argument: a line does not have the format that open_slurm() requests.
Result<std::vector<EngineWorker>> parse_squeue(const std::string& lines);

// ssh: workers run on a list of machines, for sites without Slurm, Docker or Kubernetes.
struct SshOptions {
  WorkerCommand worker;  // token_file is on this machine; its content is sent through the connection
  std::string join_token;
  std::vector<std::string> machines;  // names for ssh: HOST, USER@HOST or a name in its configuration
  std::string config;                 // ssh's configuration file; empty: the default one
  std::string logs = ".";             // folder for the workers' logs
};

// Opens an engine that runs one worker per machine. A worker lives as long as its ssh connection: when the
// connection breaks, or `farm up` ends, the worker delivers its results and ends. failed_precondition: ssh is
// not installed.
Result<std::unique_ptr<Engine>> open_ssh(SshOptions options);

// Reads a list of machines, one per line; # begins a comment. invalid_argument: a line is not a machine's
// name (the message has file and line), the list is empty, or a name occurs twice.
Result<std::vector<std::string>> read_machines(const std::filesystem::path& file);

// Docker: workers are containers. `docker run` starts them, `docker ps` lists them, and signals drain and end
// them.
struct DockerOptions {
  WorkerCommand worker;  // `program` is a path in the container image
  std::string join_token;
  std::string image;             // name of the container image, which deploy/images.sh builds
  int drain_seconds = 120;       // how long Docker lets a worker drain if another command stops its container
  std::string logs = ".";        // folder for the logs of workers that have ended
  std::vector<std::string> run;  // more options of `docker run`, one word each
};

// failed_precondition: no Docker engine answers.
Result<std::unique_ptr<Engine>> open_docker(DockerOptions options);
// Reads the lines of `docker ps`; `unix_time` is now, in seconds since 1970. invalid_argument: a line is not
// in the format that open_docker() asks for.
Result<EngineList> parse_docker_ps(const std::string& lines, double unix_time);

// Kubernetes: workers are pods. kubectl starts, lists, drains and ends them. A pod is made from the template
// in a Deployment of the cluster, so that image, secrets, TLS and security settings are given in one place,
// the Deployment's manifest.
struct KubernetesOptions {
  std::string farm;
  std::string like = "deployment/worker";  // the Deployment from whose template pods are made
  int threads = 1;                         // cores that the template must request
  int drain_seconds = 120;  // the pods' grace period: time that a worker has to deliver its results and end
  int minutes = 60;         // time limit, after which Kubernetes ends the pod, with that grace period
  std::string logs = ".";   // folder for the logs of workers that have ended
  std::vector<std::string> kubectl;         // more options of kubectl, one word each
  std::vector<std::string> worker_options;  // more command line options of the worker
};

// failed_precondition: kubectl does not reach a cluster, or the cluster has no such Deployment.
// invalid_argument: the Deployment's pods do not request `threads` cores.
Result<std::unique_ptr<Engine>> open_kubernetes(KubernetesOptions options);

// Returns the pod of a new worker, made from the template in `deployment`, which `kubectl get -o json` has
// printed. invalid_argument: there is no template, or it does not request `options.threads` cores.
Result<nlohmann::json> pod_like(const nlohmann::json& deployment, const KubernetesOptions& options,
                                const std::string& id);

// Reads the output of `kubectl get pods -o json`; `unix_time` is now, in seconds since 1970.
// invalid_argument: it is not a list of pods that were made by pod_like().
Result<EngineList> parse_pods(const nlohmann::json& list, double unix_time);

}  // namespace ls::cli
