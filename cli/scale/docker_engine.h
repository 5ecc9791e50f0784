// Runs workers as containers of Docker: `docker run` starts them, `docker ps` lists them, and signals drain
// and end them. To *drain* a worker is to ask it to deliver its results and end.
#pragma once

#include <functional>

#include "cli/scale/engine.h"

namespace ls::cli {

struct DockerOptions {
  WorkerCommand worker;  // `program` is the path in the image
  std::string join_token;
  std::string image;             // name of the image, which deploy/images.sh builds
  int drain_seconds = 120;       // how long Docker lets a worker drain if another command stops its container
  std::string logs = ".";        // folder for the logs of workers that have ended
  std::vector<std::string> run;  // more options of `docker run`, one word each
};

// `unix_time` returns the seconds since 1970. failed_precondition: no Docker engine answers.
Result<std::unique_ptr<Engine>> open_docker(DockerOptions options, std::function<double()> unix_time);

struct DockerContainers {
  std::vector<EngineWorker> workers;
  std::vector<std::string> ended;  // ids of containers that have ended
};
// Reads the lines of `docker ps`. invalid_argument: a line is not in the format that open_docker() asks for.
Result<DockerContainers> parse_docker_ps(const std::string& lines, double unix_time);

}  // namespace ls::cli
