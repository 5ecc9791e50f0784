// Scene analysis: what a scene needs, and which of its parts are left out of the rendering. It is stored with
// the job in two forms: for the workers, and as text for people.
#pragma once

#include "common/scene/analysis/needs.h"
#include "common/scene/analysis/prune.h"
#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {

// Sets needs, features and analysis of `job`. `pruned` is the scene as the job's integrator sees it.
void note_analysis(const scene::Pruned& pruned, const RenderSettings& settings, StoredJob& job);

}  // namespace ls::coordinator
