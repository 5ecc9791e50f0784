// `lightshaft render`: one job on a LocalFarm, from the scene to the output files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "cli/local/local_scene.h"
#include "cli/output/progress.h"

namespace ls::cli {

struct LocalRenderOptions {
  JobSpec spec;
  int threads = 1;
  bool isolate = false, quiet = false, strict = false;
  ProgressForm progress = ProgressForm::bar;
  std::filesystem::path out;
  std::optional<std::filesystem::path> report, html, partial_dir, reference;
};
// Renders the scene, and writes the output files; returns the exit code.
int render_locally(const LocalScene& scene, const LocalRenderOptions& options);

}  // namespace ls::cli
