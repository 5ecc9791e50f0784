// Runs workers on a list of machines over ssh, for sites without Slurm, Docker or Kubernetes.
#pragma once

#include <filesystem>

#include "cli/scale/engine.h"
#include "common/base/clock.h"

namespace ls::cli {

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
Result<std::unique_ptr<Engine>> open_ssh(SshOptions options, const Clock& clock);

// Reads a list of machines, one per line; # begins a comment. invalid_argument: a line is not a machine's
// name (the message has file and line), the list is empty, or a name occurs twice.
Result<std::vector<std::string>> read_machines(const std::filesystem::path& file);

}  // namespace ls::cli
