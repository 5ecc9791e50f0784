#include "coordinator/service/provenance.h"

#include <fmt/format.h>

#include "common/base/log.h"
#include "common/scene/json/serialize.h"
#include "coordinator/admission/cryptomatte_manifests.h"

namespace ls::coordinator {
namespace {

CryptomatteManifests cryptomatte_manifests_of(const StoredJob& job, const BlobStore& blobs) {
  if (!wants_labels(job.settings)) return {};
  const auto size = blobs.size(job.scene);
  const auto json = size ? blobs.read(job.scene, 0, *size)
                         : Result<std::vector<std::byte>>(fail(Errc::not_found, "its scene is not stored"));
  const auto scene = json ? deserialize_scene({reinterpret_cast<const char*>(json->data()), json->size()})
                          : Result<Scene>(tl::unexpected(json.error()));
  if (scene) return manifests_of(*scene, aovs_of(job.settings));
  log_warn(fmt::format("job={}", job.id.value), "mattes without names: " + scene.error().message);
  return {};
}

}  // namespace

Provenance provenance_of(const ReportFacts& facts, const BlobStore& blobs) {
  const StoredJob& job = facts.job;
  const Health& health = job.totals.health;
  const std::string note = job.stopped ? note_on(*job.stopped) : "";
  std::string stopped = job.stopped ? std::string(to_string(*job.stopped)) : "";
  if (!note.empty()) stopped += "; " + note;
  return {job.scene,
          canonical_json(job.settings),
          job.build,
          job.numeric_class.value_or(Digest{}),
          job.settings.seed,
          job.totals.render_seconds,
          health.clean() ? "clean" : canonical_json(health),
          cryptomatte_manifests_of(job, blobs),
          job.totals.core_seconds,
          std::move(stopped),
          convergence_status_of(facts),
          header_figures(facts),
          header_notes(facts)};
}

}  // namespace ls::coordinator
