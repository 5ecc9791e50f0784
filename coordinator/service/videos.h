// Videos of sequences, made on request: ffmpeg gets the tone-mapped pictures of the frames that are done. One
// video is made at a time, on a thread of its own; a few more requests wait. A video lies in the folder of
// its sequence's first frame and is removed with that frame. When the coordinator restarts, it forgets all
// requests and videos. Thread-safe.
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <stop_token>
#include <vector>

#include "coordinator/base/work_queue.h"
#include "coordinator/service/pictures.h"
#include "coordinator/service/state/job_files.h"
#include "core/base/guarded.h"

namespace ls::coordinator {

class Videos {
 public:
  Videos(Guarded<Core>& core, const JobFiles& files, const Pictures& pictures, const Clock& clock)
      : core_(core), files_(files), pictures_(pictures), clock_(clock) {}

  // Requests a video of the frames that are done now. It replaces an earlier video of the sequence.
  Result<VideoView> make(const JobId& sequence, const VideoAsked& asked);
  Result<VideoView> view(const JobId& sequence) const;
  // Returns the file of a video that is ready. failed_precondition: there is none; the message gives the
  // reason.
  Result<std::filesystem::path> file(const JobId& sequence) const;
  void loop(const std::stop_token& stop);

 private:
  struct Video {
    VideoView view;
    std::vector<JobId> frames;
    std::filesystem::path path;
  };
  void forget_removed(Core& core);
  Result<void> encode(const JobId& sequence, const Video& video, const std::stop_token& stop);

  Guarded<Core>& core_;
  const JobFiles& files_;
  const Pictures& pictures_;
  const Clock& clock_;
  mutable std::mutex mutex_;  // a thread that needs both locks takes core_ first
  std::map<JobId, Video> videos_;
  WorkQueue<JobId> waiting_;
};

}  // namespace ls::coordinator
