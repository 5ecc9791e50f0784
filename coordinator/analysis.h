// What a scene needs and what is left out of it, in the forms that a job keeps: for its workers, and in words
// for people.
#pragma once

#include "common/scene/needs.h"
#include "common/scene/prune.h"
#include "coordinator/store/job_store.h"

namespace ls::coordinator {

// Fills the job's needs, features and analysis. `pruned`: as the job's integrator sees it.
void note_analysis(const scene::Pruned& pruned, const RenderSettings& settings, StoredJob& job);

}  // namespace ls::coordinator
