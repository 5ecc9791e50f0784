#include "cli/local_world.h"

#include "common/scene/integrators.h"
#include "common/scene/serialize.h"
#include "coordinator/store/memory_blobs.h"
#include "worker/render/thread_limit.h"

namespace ls::cli {

tl::expected<LocalWorld, coordinator::Rejected> build_local_world(const LocalScene& scene,
                                                                  const JobSpec& spec, int threads) {
  coordinator::MemoryBlobs blobs;
  render::AssetFiles files;
  for (const auto& [name, file] : scene.files) {
    if (const auto adopted = blobs.adopt(file.digest, file.path); !adopted)
      return tl::unexpected(coordinator::Rejected{adopted.error(), {}});
    files.emplace(file.digest, file.path);
  }
  auto intake = coordinator::take_in(submit_request(scene, spec), blobs, scene.frame);
  if (!intake) return tl::unexpected(std::move(intake.error()));
  const auto limit = render::limit_threads(threads);
  // As a worker would get it.
  const auto stored = deserialize_scene(intake->scene_json);
  if (!stored) return tl::unexpected(coordinator::Rejected{stored.error(), {}});
  auto world = render::build_world(*stored, intake->job.settings, files, threads);
  if (!world && world.error().code == Errc::invalid_argument)
    return tl::unexpected(scene_fault(scene, world.error().message));
  if (!world) return tl::unexpected(coordinator::Rejected{world.error(), {}});
  const bool sees_media = scene::sees_media(intake->job.settings.integrator);
  return LocalWorld{std::move(intake->job), std::move(*world), scene::needs_of(*stored, sees_media),
                    intake->scene_json.size()};
}

tl::expected<std::shared_ptr<const render::World>, coordinator::Rejected> build_world_again(
    const LocalScene& scene, const RenderSettings& settings, int threads) {
  render::AssetFiles files;
  for (const auto& [name, file] : scene.files) files.emplace(file.digest, file.path);
  auto world = render::build_world(scene.scene, settings, files, threads);
  if (world) return std::move(*world);
  if (world.error().code == Errc::invalid_argument)
    return tl::unexpected(scene_fault(scene, world.error().message));
  return tl::unexpected(coordinator::Rejected{world.error(), {}});
}

coordinator::Rejected scene_fault(const LocalScene& scene, const std::string& text) {
  Diagnostic d;
  d.place.file = scene.name;
  d.text = text;
  return {{Errc::invalid_argument, text}, {std::move(d)}};
}

}  // namespace ls::cli
