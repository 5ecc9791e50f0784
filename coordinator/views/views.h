// Writes views (what clients see of jobs, tiles and workers; job_view.h) as JSON and CSV. Missing values are
// null.
#pragma once

#include <string>
#include <vector>

#include "coordinator/views/job_view.h"

namespace ls::coordinator {

std::string time_json(const TimeSplit& time);
std::string job_json(const JobView& job);
std::string jobs_json(const std::vector<JobView>& jobs);  // {"jobs": [...]}
std::string worker_json(const WorkerView& worker);
std::string workers_json(const std::vector<WorkerView>& workers);          // {"workers": [...]}
std::string tiles_json(const std::vector<TileView>& tiles);                // {"tiles": [...]}
std::string convergence_csv(const std::vector<ConvergencePoint>& points);  // with a header line

// The functions below return the data of events for clients. `state` of a tile: "leased", "folded" or "free".
std::string tile_event_json(const JobId& job, TileIndex tile, const PixelRect& rect, std::string_view state,
                            std::uint64_t spp, std::string_view worker);
std::string worker_gone_json(const WorkerId& worker);
std::string job_removed_json(const JobId& job);  // the last `job` event of this job
// The last `job` event of this job that this coordinator sends: another coordinator continues the job
std::string job_moved_json(const JobId& job);

}  // namespace ls::coordinator
