// Workers as containers of Docker: `docker run` starts them, `docker ps` lists them, signals drain and end
// them.
#pragma once

#include <functional>

#include "cli/scale/engine.h"

namespace ls::cli {

struct DockerOptions {
  WorkerCommand worker;  // program: in the image
  std::string join_token;
  std::string image;             // deploy/images.sh makes it
  int drain_seconds = 120;       // that Docker gives a worker which somebody else stops
  std::string logs = ".";        // folder for the logs of workers that have ended
  std::vector<std::string> run;  // more options of `docker run`, one word each
};

// `unix_time`: seconds since 1970. failed_precondition: no Docker engine answers.
Result<std::unique_ptr<Engine>> open_docker(DockerOptions options, std::function<double()> unix_time);

struct DockerContainers {
  std::vector<EngineWorker> workers;
  std::vector<std::string> ended;  // ids
};
// Reads the lines of `docker ps`. invalid_argument: a line is not in the format that open_docker() asks for.
Result<DockerContainers> parse_docker_ps(const std::string& lines, double unix_time);

}  // namespace ls::cli
