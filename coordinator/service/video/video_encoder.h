// Runs ffmpeg as a child process that makes a video file of pictures. The program gets raw pixels through a
// socket, so it never reads a file of a job. It is killed when it reads no pixels for too long, when it
// reaches the time limit for a video, or when the coordinator stops.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "coordinator/store/files.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/image/frame/frame.h"

namespace ls::coordinator {

// Returns the path of the program ffmpeg in the folders of PATH. failed_precondition: there is none; the
// message explains how to install it.
Result<std::string> find_ffmpeg();

class VideoEncoder {
 public:
  struct Asked {
    std::string ffmpeg;  // path of the program ffmpeg
    std::filesystem::path file;
    FrameSize size;
    double fps = 24;
    std::uint64_t most_bytes = 0;  // greatest size of the video file
    TimePoint until{};             // the program is killed at this time
    Duration stall_limit{};        // it is also killed when it takes no pixels for this long
  };
  // Starts the program. It is killed as soon as `stop` is requested.
  static Result<std::unique_ptr<VideoEncoder>> start(const Asked& asked, const Clock& clock,
                                                     std::stop_token stop);
  ~VideoEncoder();  // kills the program if it runs

  // Adds one picture: 8 bits of R, G and B of each pixel, row by row, Asked::size in total.
  Result<void> add(std::span<const std::uint8_t> rgb);
  // Completes the file. If the program failed, the error contains the program's own message.
  Result<void> finish();

 private:
  VideoEncoder(Asked asked, const Clock& clock, std::stop_token stop, File pixels, File errors,
               pid_t program);
  Result<void> wait_for(int fd, short events);
  void hear();  // reads the program's messages
  Error ended();
  int end();

  const Asked asked_;
  const Clock& clock_;
  const std::stop_token stop_;
  File pixels_;  // the coordinator's end of the socket; closed by end()
  const File errors_;
  std::optional<pid_t> program_;
  std::string reported_;
};

}  // namespace ls::coordinator
