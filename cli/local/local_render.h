// `lightshaft render`: one job on a LocalFarm, from the scene to the output files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
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
  bool out_by_default = false;  // true: the user has not named `out`, which is for an image
  std::optional<std::filesystem::path> report, html, partial_dir, reference;
  std::string view;                           // of a PNG; empty: sRGB
  std::shared_ptr<const DisplayViews> views;  // has `view`; null if that is empty
};
// Renders the scene, and writes the output files; returns the exit code.
int render_locally(const LocalScene& scene, const LocalRenderOptions& options);

// Facts about the render that only this process has; the coordinator's report lacks them.
struct LocalFacts {
  double load_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;
  int threads = 1;
  bool interrupted = false;
  // Number of instructions that the whole process has executed; an error: why they were not counted.
  Result<std::uint64_t> instructions = 0;
};
// Returns `report`, the coordinator's report in JSON, with `facts` added and the scene's path reduced to its
// file name.
Result<nlohmann::json> local_report(const std::string& report, const LocalFacts& facts);

// Returns one line with the main results of the report.
std::string report_summary(const nlohmann::json& report);

}  // namespace ls::cli
