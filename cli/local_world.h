// A scene made ready to trace in this process, without a farm: for `inspect` and for the replay of one
// sample.
#pragma once

#include <memory>

#include "cli/local_scene.h"
#include "common/scene/needs.h"
#include "coordinator/intake.h"
#include "worker/render/render.h"

namespace ls::cli {

struct LocalWorld {
  coordinator::StoredJob job;  // settings and samples as a job would have them; warnings
  std::shared_ptr<const render::World> world;
  scene::Needs needs;
  std::uint64_t scene_bytes = 0;  // of the canonical scene, as it goes to workers
};
// The settings are resolved and the limits checked exactly as for a job.
tl::expected<LocalWorld, coordinator::Rejected> build_local_world(const LocalScene& scene,
                                                                  const JobSpec& spec, int threads);

// The world of settings that an image was rendered with: nothing of them is left to the scene.
tl::expected<std::shared_ptr<const render::World>, coordinator::Rejected> build_world_again(
    const LocalScene& scene, const RenderSettings& settings, int threads);

// What is wrong with one of the scene's files, as a diagnostic of the scene as a whole.
coordinator::Rejected scene_fault(const LocalScene& scene, const std::string& text);

}  // namespace ls::cli
