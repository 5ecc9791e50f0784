#include "coordinator/service/video/video_encoder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "core/base/safe_text.h"
#include "core/base/spawn.h"

namespace ls::coordinator {
namespace {

constexpr std::size_t kMostReported = 2000;  // ffmpeg's messages are kept up to this many bytes

// True if ffmpeg inherits this environment variable: only those of the dynamic loader, such as
// LD_LIBRARY_PATH.
bool inherits(std::string_view variable) { return variable.starts_with("LD_"); }

std::vector<std::string> command(const VideoEncoder::Asked& asked) {
  return {"ffmpeg", "-hide_banner", "-nostdin", "-loglevel", "error",
          // Raw pixels from standard input
          "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size",
          fmt::format("{}x{}", asked.size.width, asked.size.height), "-framerate",
          fmt::format("{:.6g}", asked.fps), "-i", "pipe:0",
          // yuv420p stores colour at half the resolution, so width and height are padded to even numbers
          "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
          "-c:v", "libx264", "-preset", "medium", "-crf", "16", "-threads", "2", "-colorspace", "bt709",
          "-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-fs",
          fmt::format("{}", asked.most_bytes), "-movflags", "+faststart", "-f", "mp4", "-y",
          "file:" + asked.file.string()};
}

}  // namespace

Result<std::string> find_ffmpeg() {
  const char* path = std::getenv("PATH");
  std::string_view left = path == nullptr ? "" : path;
  while (!left.empty()) {
    const std::string_view folder = left.substr(0, left.find(':'));
    left.remove_prefix(std::min(left.size(), folder.size() + 1));
    const std::string file = std::string(folder) + "/ffmpeg";
    if (!folder.empty() && ::access(file.c_str(), X_OK) == 0) return file;
  }
  return fail(Errc::failed_precondition,
              "the coordinator's machine has no ffmpeg, which makes videos: install it there "
              "(apt-get install ffmpeg), then ask again");
}

Result<std::unique_ptr<VideoEncoder>> VideoEncoder::start(const Asked& asked, const Clock& clock,
                                                          std::stop_token stop) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return fail(Errc::internal, fmt::format("cannot make a socket for ffmpeg: {}", std::strerror(errno)));
  File pixels(ends[0]);
  const File its_input(ends[1]);
  if (::pipe2(ends.data(), O_CLOEXEC) != 0)
    return fail(Errc::internal, fmt::format("cannot make a pipe for ffmpeg: {}", std::strerror(errno)));
  File errors(ends[0]);
  const File its_errors(ends[1]);
  const auto program =
      spawn({asked.ffmpeg, command(asked), {its_input.fd(), kDevNull, its_errors.fd()}, inherits});
  if (!program) return tl::unexpected(program.error());
  for (const File* file : {&pixels, &errors}) ::fcntl(file->fd(), F_SETFL, O_NONBLOCK);
  return std::unique_ptr<VideoEncoder>(
      new VideoEncoder(asked, clock, std::move(stop), std::move(pixels), std::move(errors), *program));
}

VideoEncoder::VideoEncoder(Asked asked, const Clock& clock, std::stop_token stop, File pixels, File errors,
                           pid_t program)
    : asked_(std::move(asked)),
      clock_(clock),
      stop_(std::move(stop)),
      pixels_(std::move(pixels)),
      errors_(std::move(errors)),
      program_(program) {}

VideoEncoder::~VideoEncoder() {
  if (program_) ::kill(*program_, SIGKILL);
  end();
}

// Closes the socket, waits until the program ends, and returns its exit status.
int VideoEncoder::end() {
  pixels_ = File();
  const int status = program_ ? wait_for_end(*program_) : 0;
  program_.reset();
  return status;
}

void VideoEncoder::hear() {
  std::array<char, 1024> bytes;
  ssize_t got = 0;
  while ((got = ::read(errors_.fd(), bytes.data(), bytes.size())) > 0)
    reported_.append(bytes.data(), std::min(static_cast<std::size_t>(got),
                                            kMostReported - std::min(kMostReported, reported_.size())));
}

// Waits for `events` on `fd`: until the program can take more pixels, or until it has closed its standard
// error because it ended.
Result<void> VideoEncoder::wait_for(int fd, short events) {
  const std::stop_callback kill_it(stop_, [pid = *program_] { ::kill(pid, SIGKILL); });
  const TimePoint stalled_at = clock_.now() + asked_.stall_limit;
  for (;;) {
    const TimePoint until = std::min(stalled_at, asked_.until);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - clock_.now()).count();
    if (stop_.stop_requested()) return fail(Errc::unavailable, "the coordinator stops");
    if (left <= 0)
      return fail(Errc::unavailable,
                  until == asked_.until
                      ? "the time for one video is up: ask for fewer frames or a smaller size"
                      : "ffmpeg made no progress; it was killed");
    std::array<pollfd, 2> watched = {pollfd{errors_.fd(), POLLIN, 0}, pollfd{fd, events, 0}};
    const int ready = ::poll(watched.data(), 2, static_cast<int>(std::min<std::int64_t>(left, 60'000)));
    if (ready < 0 && errno != EINTR)
      return fail(Errc::internal, fmt::format("waiting for ffmpeg: {}", std::strerror(errno)));
    if (watched[0].revents != 0) hear();
    if (watched[1].revents != 0 || (watched[0].revents & POLLHUP) != 0) return {};
  }
}

Error VideoEncoder::ended() {
  hear();
  const int status = end();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
    return {Errc::resource_exhausted,
            fmt::format("the video has more than {} bytes: ask for fewer frames or a smaller size",
                        asked_.most_bytes)};
  const std::string why = WIFSIGNALED(status) ? fmt::format("it was killed by signal {}", WTERMSIG(status))
                                              : fmt::format("it ended with code {}", WEXITSTATUS(status));
  return {Errc::internal,
          fmt::format("ffmpeg made no video: {}", reported_.empty() ? why : plain_text(reported_))};
}

Result<void> VideoEncoder::add(std::span<const std::uint8_t> rgb) {
  while (!rgb.empty()) {
    const ssize_t sent = ::send(pixels_.fd(), rgb.data(), rgb.size(), MSG_NOSIGNAL);
    if (sent > 0) {
      rgb = rgb.subspan(static_cast<std::size_t>(sent));
    } else if (errno == EPIPE || errno == ECONNRESET) {
      return tl::unexpected(ended());
    } else if (errno != EAGAIN && errno != EINTR) {
      return fail(Errc::internal, fmt::format("sending pixels to ffmpeg: {}", std::strerror(errno)));
    } else if (auto ready = wait_for(pixels_.fd(), POLLOUT); !ready) {
      return ready;
    }
  }
  return {};
}

Result<void> VideoEncoder::finish() {
  ::shutdown(pixels_.fd(), SHUT_WR);
  // The program closes its standard error when it ends.
  if (auto closed = wait_for(errors_.fd(), POLLHUP); !closed) return closed;
  hear();
  const int status = end();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  return fail(Errc::internal,
              fmt::format("ffmpeg made no video: {}",
                          reported_.empty() ? fmt::format("wait status {}", status) : plain_text(reported_)));
}

}  // namespace ls::coordinator
