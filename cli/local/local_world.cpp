#include "cli/local/local_world.h"

#include "coordinator/store/blobs/memory_blobs.h"
#include "core/scene/json/serialize.h"
#include "core/scene/schema/integrators.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

using BuiltWorld = tl::expected<std::shared_ptr<const render::World>, coordinator::Rejected>;

// Builds the world (the scene prepared for tracing) from `description`: the scene as a worker receives it, or
// as it was read. `scene` provides the files, and the name for error messages.
BuiltWorld build(const LocalScene& scene, const Scene& description, const RenderSettings& settings,
                 int threads) {
  render::AssetFiles files;
  for (const auto& [name, file] : scene.files) files.emplace(file.digest, file.path);
  auto world = render::build_world(description, settings, files, threads);
  if (world) return std::move(*world);
  if (world.error().code == Errc::invalid_argument)
    return tl::unexpected(scene_fault(scene.name, world.error().message));
  return coordinator::rejected(world.error());
}

}  // namespace

tl::expected<LocalWorld, coordinator::Rejected> build_local_world(const LocalScene& scene,
                                                                  const JobSpec& spec, int threads) {
  coordinator::MemoryBlobs blobs;
  for (const auto& [name, file] : scene.files)
    if (const auto adopted = blobs.adopt(file.digest, file.path); !adopted)
      return coordinator::rejected(adopted.error());
  auto admission =
      coordinator::admit(submit_request(scene, spec), blobs, scenes_in_this_process(), scene.frame);
  if (!admission) return tl::unexpected(std::move(admission.error()));
  const auto limit = render::limit_threads(threads);
  // The scene in the form that a worker receives.
  const auto stored = deserialize_scene(admission->scene_json);
  if (!stored) return coordinator::rejected(stored.error());
  auto world = build(scene, *stored, admission->job.settings, threads);
  if (!world) return tl::unexpected(std::move(world.error()));
  const bool sees_media = scene::sees_media(admission->job.settings.integrator);
  return LocalWorld{std::move(admission->job), std::move(*world), scene::needs_of(*stored, sees_media),
                    admission->scene_json.size()};
}

BuiltWorld build_world_again(const LocalScene& scene, const RenderSettings& settings, int threads) {
  return build(scene, scene.scene, settings, threads);
}

}  // namespace ls::cli
