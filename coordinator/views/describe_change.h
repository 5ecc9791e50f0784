// The table of what a user can change in a job (core/job/setting.h): the body of PATCH /api/v1/jobs/ID.
#pragma once

#include <array>
#include <span>

#include "coordinator/base/limits.h"
#include "coordinator/domain/job_state.h"
#include "coordinator/views/views.h"
#include "core/job/describe.h"

namespace ls::coordinator {

// The states that a user can request.
inline std::span<const JobState> offered(JobState) {
  static constexpr std::array kAll{JobState::paused, JobState::running, JobState::cancelled};
  return kAll;
}

// Returns the row with other sentences.
constexpr job::Setting reworded(job::Setting row, std::string_view doc, std::string_view more) {
  row.doc = doc;
  row.more = more;
  return row;
}

template <class V, job::Of<JobChange> T>
void describe(V& v, T& c) {
  v.setting({.name = "name", .doc = "The job's name in lists.", .range = {1, limits::kMaxShownName}}, c.name);
  v.setting({.name = "state", .doc = "The job pauses, is rendered further, or ends for good."}, c.state);
  v.setting(job::kPriority, c.priority);
  v.setting(reworded(job::kSpp, "The new total of samples per pixel.",
                     "If the job has reached its end, all its tiles get this many samples, and it has no "
                     "target error or time any more."),
            c.spp);
  v.setting(reworded(job::kTargetError, "The new target error of a job that has one.",
                     "A smaller target continues a job that has reached a larger one; the pixels are the "
                     "same as with the smaller target from the beginning. Not together with `spp`."),
            c.target_error);
  v.setting(reworded(job::kAfter, "Ids of the jobs that must be done before this job begins; [] for none.",
                     "They replace the earlier ones. A job that would wait for itself, directly or through "
                     "other jobs, is an error (400), and so is a job that has begun (409): pause it instead. "
                     "Frames of a sequence that have begun continue, and the others wait."),
            c.after);
  v.setting({.name = "focus",
             .doc = "Rectangle [x0, y0, x1, y1] in pixels, without x1 and y1, whose tiles get the next "
                    "samples before all others; null for none.",
             .more = "It changes only the order of the work: an image that ends by `spp` or `target_error` "
                     "has the same bits with and without it. It is stored with the job, and applies to all "
                     "frames of a sequence.",
             .option = "--region",
             .placeholder = "X0,Y0,X1,Y1"},
            c.focus);
}

}  // namespace ls::coordinator
