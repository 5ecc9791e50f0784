// Scene analysis: what a scene needs and which parts are left out, as stored with the job for its workers and
// in words for people.
#pragma once

#include "common/scene/analysis/needs.h"
#include "common/scene/analysis/prune.h"
#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {

// Fills the job's needs, features and analysis. `pruned`: the scene as the job's integrator sees it.
void note_analysis(const scene::Pruned& pruned, const RenderSettings& settings, StoredJob& job);

}  // namespace ls::coordinator
