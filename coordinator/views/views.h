// Writes views (job_view.h) as JSON and CSV for clients. Missing values are null.
#pragma once

#include <string>
#include <vector>

#include "coordinator/views/job_list.h"
#include "coordinator/views/job_view.h"

namespace ls::coordinator {

std::string time_json(const TimeSplit& time);
std::string job_json(const JobView& job);
// returns {"jobs": [...], "total", "states": {NAME: number}, "owners"}
std::string jobs_json(const JobsPage& page);
std::string worker_json(const WorkerView& worker);
std::string workers_json(const std::vector<WorkerView>& workers);  // returns {"workers": [...]}
std::string video_json(const VideoView& video);
std::string tiles_json(const std::vector<TileView>& tiles);                // returns {"tiles": [...]}
std::string convergence_csv(const std::vector<ConvergencePoint>& points);  // starts with a header line

// The functions below return the data of events for clients. `state` of a tile is "leased", "folded" (a
// result was added to the image) or "free".
std::string tile_event_json(const JobId& job, TileIndex tile, const PixelRect& rect, std::string_view state,
                            std::uint64_t spp, std::string_view worker);
std::string worker_gone_json(const WorkerId& worker);
std::string job_removed_json(const JobId& job);  // the last `job` event of this job
// The last `job` event that this coordinator sends for the job: another coordinator continues the job
std::string job_moved_json(const JobId& job);

}  // namespace ls::coordinator
