// Runs workers as jobs of Slurm: sbatch starts them as an array, squeue lists them, scancel drains and stops
// them. To *drain* a worker is to ask it to deliver its results and end.
#pragma once

#include "cli/scale/engine.h"

namespace ls::cli {

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

}  // namespace ls::cli
