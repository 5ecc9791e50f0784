// A job's record in which most fields are set.
#pragma once

#include <string>

#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {

inline StoredJob sample_job(std::string id) {
  StoredJob job;
  job.id.value = std::move(id);
  job.name = "Steam, take 2";
  job.scene_name = "steam.xml";
  job.owner = "anna";
  job.submitted_unix = 1.7e9 + .25;
  job.scene = sha256("scene");
  job.settings.size = {64, 32};
  job.settings.integrator = "volpath";
  job.spec.target_error = .01;
  job.spec.defines = {{"density", "2"}};
  job.assets = {{sha256("grid"), 4, "grid.vol"}};
  job.warnings = {"a \"quoted\" warning\n"};
  job.reference_same_seed = true;
  job.techniques.add(Technique::light_tree);
  job.denoised = DenoisedFigure{2e-4, std::pair(1e-4, 3e-4)};
  job.denoised_checks = {{64, -1e-5, std::nullopt}, {90.5, 2e-4, 3e-4}};
  job.features_used = {"volume grids"};
  job.camera = CameraMatrices{{-1, 0, 0, .1}, RowMatrix{.25}};
  job.state = JobState::running;
  job.stopped = StopReason::error;
  job.failure =
      JobFailure{.kind = FailureKind::no_worker,
                 .tile = 1,
                 .rect = {32, 0, 64, 32},
                 .round = 2,
                 .samples = {4, 8},
                 .attempts = {{"a", "out of memory", 9, std::pair(33, 1), 5}, {"b", "", {}, {}, {}}},
                 .replay = "lightshaft render scene.xml"};
  job.numeric_class = sha256("class");
  job.platform = "armv8-a:gcc-14.2.0";
  job.fake = true;
  job.missing_blobs = {sha256("gone")};
  job.totals.core_seconds = 12.125;
  job.totals.lit = false;
  job.totals.health.add(HealthCause::infinite, 3, {4, 5, 6});
  return job;
}

}  // namespace ls::coordinator
