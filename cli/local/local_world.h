// A scene prepared for tracing in this process, without a farm: for the commands `inspect`, `compare` and
// `verify`, and for rendering one sample again.
#pragma once

#include <memory>

#include "cli/local/local_scene.h"
#include "coordinator/admission/admission.h"
#include "core/scene/analysis/needs.h"
#include "worker/render/render.h"

namespace ls::cli {

struct LocalWorld {
  coordinator::StoredJob job;  // settings, samples and warnings that a job would have
  std::shared_ptr<const render::World> world;
  scene::Needs needs;
  std::uint64_t scene_bytes = 0;  // size of the canonical scene that is sent to workers
};
// Builds the world (the scene prepared for tracing). Resolves the settings and checks the limits exactly as
// for a job.
tl::expected<LocalWorld, coordinator::Rejected> build_local_world(const LocalScene& scene,
                                                                  const JobSpec& spec, int threads);

// Builds the world for the settings with which an image was rendered. The scene's own settings are ignored.
tl::expected<std::shared_ptr<const render::World>, coordinator::Rejected> build_world_again(
    const LocalScene& scene, const RenderSettings& settings, int threads);

}  // namespace ls::cli
