// Makes a new job from the scene of an earlier job, with other samples per pixel, target error, time or seed.
#include <fmt/format.h>

#include "coordinator/admission/admission.h"

namespace ls::coordinator {

Result<StoredJob> admit_again(const StoredJob& before, const JobSpec& changes, const BlobStore& blobs) {
  StoredJob job;
  job.name = before.name;
  job.scene = before.scene;
  job.settings = before.settings;
  job.spec = before.spec;
  job.spec.frames = {};  // a single frame is not a sequence
  job.spp = before.spp;
  job.assets = before.assets;
  job.warnings = before.warnings;
  job.features_used = before.features_used;
  job.features_left_out = before.features_left_out;
  job.needs = before.needs;
  job.analysis = before.analysis;
  if (changes.spp || changes.target_error || changes.time) {
    job.spp = job.spec.spp = changes.spp;
    job.spec.target_error = changes.target_error;
    if (!changes.target_error) job.spec.target_layer = TargetLayer::raw;
    job.spec.time = changes.time;
  }
  job.spec.priority = changes.priority;
  if (changes.seed) job.settings.seed = *(job.spec.seed = changes.seed);
  for (const BlobRef& asset : job.assets)
    if (!blobs.has(asset.digest))
      return fail(Errc::failed_precondition,
                  fmt::format("the file {} of the scene is not here any more: PUT /api/v1/blobs/{} first",
                              asset.name, asset.digest.hex()));
  if (!blobs.has(job.scene))
    return fail(Errc::failed_precondition, "the scene of this job is not here any more: submit it again");
  if (job.spec.reference) {
    const auto reference = load_reference(job.spec, job.settings.size, blobs);
    if (!reference) return tl::unexpected(reference.error());
    job.reference_same_seed = same_noise(reference->origin, job.scene, job.settings.seed);
  }
  JobPlan plan = plan_of(job);
  plan.brief.job.value = "new";
  if (auto ok = check_plan(plan); !ok) return tl::unexpected(ok.error());
  return job;
}

}  // namespace ls::coordinator
