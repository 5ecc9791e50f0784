#include "coordinator/service/videos.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "coordinator/base/limits.h"
#include "coordinator/service/core.h"
#include "coordinator/service/video/video_encoder.h"
#include "core/base/log.h"

namespace ls::coordinator {
namespace {

constexpr double kUsualFps = 24;  // of videos of jobs that do not state a rate

Result<void> check(const VideoAsked& asked) {
  if (asked.fps && !(*asked.fps >= limits::kMinVideoFps && *asked.fps <= limits::kMaxVideoFps))
    return fail(Errc::invalid_argument, fmt::format("'fps' must be from {} to {} pictures per second",
                                                    limits::kMinVideoFps, limits::kMaxVideoFps));
  if (!(std::abs(asked.look.exposure) <= limits::kMaxExposure))
    return fail(Errc::invalid_argument,
                fmt::format("'exposure' must be a number of stops from -{0} to {0}", limits::kMaxExposure));
  return {};
}

bool open(const VideoView& video) {
  return video.state == VideoState::waiting || video.state == VideoState::making;
}

}  // namespace

void Videos::forget_removed(Core& core) {
  std::erase_if(videos_, [&](const auto& v) { return core.jobs.sequence(v.first) == nullptr; });
}

Result<VideoView> Videos::make(const JobId& id, const VideoAsked& asked) {
  if (auto ok = check(asked); !ok) return tl::unexpected(ok.error());
  if (auto ok = pictures_.codes_of(asked.look.view); !ok) return tl::unexpected(ok.error());
  if (!files_.on_disk())
    return fail(Errc::failed_precondition, "this coordinator keeps no files (--data), so it makes no videos");
  if (const auto ffmpeg = find_ffmpeg(); !ffmpeg) return tl::unexpected(ffmpeg.error());
  const auto core = core_.lock();
  const Sequence* sequence = core->jobs.sequence(id);
  if (sequence == nullptr) {
    if (const auto job = core->jobs.job(id); !job) return tl::unexpected(job.error());
    return fail(Errc::failed_precondition,
                fmt::format("job {} is a single image: a video is made of a sequence (frames)", id.value));
  }
  Video video;
  for (const EntryPtr& frame : sequence->frames) {
    if (!frame->broken.empty() || frame->stored.state != JobState::done) continue;
    if (asked.look.denoised && !frame->stored.spec.denoise)
      return fail(
          Errc::failed_precondition,
          fmt::format("job {} was submitted without \"denoise\": it has no denoised images", id.value));
    video.frames.push_back(frame->stored.id);
  }
  if (video.frames.empty())
    return fail(Errc::failed_precondition, fmt::format("no frame of job {} is done yet", id.value));
  video.path = files_.folder(sequence->frames.front()->stored.id) / "video.mp4";
  video.view = {VideoState::waiting, asked, video.frames.size(), 0, 0, {}};
  if (!asked.fps)
    video.view.asked.fps = std::clamp(sequence->frames.front()->stored.spec.fps.value_or(kUsualFps),
                                      limits::kMinVideoFps, limits::kMaxVideoFps);
  const std::lock_guard lock(mutex_);
  forget_removed(*core);
  if (const auto before = videos_.find(id); before != videos_.end() && open(before->second.view))
    return fail(Errc::failed_precondition,
                fmt::format("a video of job {} is being made already: wait until it is ready", id.value));
  if (waiting_.size() >= limits::kMaxVideosWaiting)
    return fail(Errc::unavailable,
                fmt::format("{} videos wait to be made: ask again later", limits::kMaxVideosWaiting));
  const VideoView view = video.view;
  videos_[id] = std::move(video);
  waiting_.push(id);
  return view;
}

Result<VideoView> Videos::view(const JobId& id) const {
  {
    const auto core = core_.lock();
    if (core->jobs.sequence(id) == nullptr)
      if (const auto job = core->jobs.job(id); !job) return tl::unexpected(job.error());
  }
  const std::lock_guard lock(mutex_);
  const auto found = videos_.find(id);
  return found == videos_.end() ? VideoView{} : found->second.view;
}

Result<std::filesystem::path> Videos::file(const JobId& id) const {
  const auto video = view(id);
  if (!video) return tl::unexpected(video.error());
  if (video->state == VideoState::failed) return fail(Errc::failed_precondition, video->error);
  if (video->state != VideoState::ready)
    return fail(Errc::failed_precondition,
                open(*video)
                    ? fmt::format("the video of job {} is not ready yet: {} of {} frames are in it", id.value,
                                  video->frames_done, video->frames)
                    : fmt::format("job {0} has no video: POST /api/v1/jobs/{0}/video first", id.value));
  const std::lock_guard lock(mutex_);
  const auto found = videos_.find(id);
  return found == videos_.end() ? std::filesystem::path() : found->second.path;
}

void Videos::loop(const std::stop_token& stop) {
  while (!stop.stop_requested())
    for (const JobId& id : waiting_.pop(1, stop)) {
      Video video;
      {
        const std::lock_guard lock(mutex_);
        const auto found = videos_.find(id);
        if (found == videos_.end()) continue;
        found->second.view.state = VideoState::making;
        video = found->second;
      }
      const auto made = encode(id, video, stop);
      std::error_code none;
      if (!made) {
        std::filesystem::remove(video.path.string() + ".part", none);
        log_warn(fmt::format("job={}", id.value), "no video: " + made.error().message);
      }
      const std::lock_guard lock(mutex_);
      const auto found = videos_.find(id);
      if (found == videos_.end()) continue;
      VideoView& view = found->second.view;
      view.state = made ? VideoState::ready : VideoState::failed;
      if (made) view.bytes = std::filesystem::file_size(video.path, none);
      if (!made) view.error = made.error().message;
    }
}

Result<void> Videos::encode(const JobId& id, const Video& video, const std::stop_token& stop) {
  const auto ffmpeg = find_ffmpeg();
  if (!ffmpeg) return tl::unexpected(ffmpeg.error());
  const std::filesystem::path part = video.path.string() + ".part";
  const TimePoint until = clock_.now() + limits::kMaxVideoTime;
  std::unique_ptr<VideoEncoder> encoder;
  FrameSize size;
  for (const JobId& frame : video.frames) {
    auto picture = pictures_.shown(frame, video.view.asked.look, limits::kMaxVideoSide);
    if (!picture) return tl::unexpected(picture.error());
    if (!encoder) {
      size = picture->size;
      auto started = VideoEncoder::start({*ffmpeg, part, size, *video.view.asked.fps, limits::kMaxVideoBytes,
                                          until, limits::kVideoStallLimit},
                                         clock_, stop);
      if (!started) return tl::unexpected(started.error());
      encoder = std::move(*started);
    }
    if (picture->size != size)
      return fail(Errc::failed_precondition,
                  fmt::format("frame {} has another size than the first one", frame.value));
    if (auto added = encoder->add(picture->rgb); !added) return added;
    if (stop.stop_requested()) return fail(Errc::unavailable, "the coordinator stops");
    if (clock_.now() > until)
      return fail(Errc::unavailable, "the time for one video is up: ask for fewer frames");
    const std::lock_guard lock(mutex_);
    if (const auto found = videos_.find(id); found != videos_.end()) ++found->second.view.frames_done;
  }
  if (auto finished = encoder->finish(); !finished) return finished;
  std::error_code error;
  std::filesystem::rename(part, video.path, error);
  if (error) return fail(Errc::internal, fmt::format("{}: {}", video.path.string(), error.message()));
  return {};
}

}  // namespace ls::coordinator
