// The coordinator survives whatever the video program does. Shell scripts take the part of the program.
#include "coordinator/service/video/video_encoder.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

namespace ls::coordinator {
namespace {

using testing::HasSubstr;

class VideoEncoding : public testing::Test {
 protected:
  VideoEncoding() { std::filesystem::create_directories(folder); }
  ~VideoEncoding() override { std::filesystem::remove_all(folder); }

  // Makes a program that runs this script and writes its process id to a file.
  VideoEncoder::Asked program(const std::string& script) {
    const std::filesystem::path file = folder / "ffmpeg";
    std::ofstream(file) << "#!/bin/sh\necho $$ > " << (folder / "pid").string() << "\n" << script << "\n";
    ::chmod(file.c_str(), 0700);
    return {.ffmpeg = file.string(),
            .file = folder / "out.mp4",
            .size = {64, 64},
            .fps = 24,
            .most_bytes = 1000,
            .until = clock.now() + std::chrono::hours(1),
            .stall_limit = std::chrono::hours(1)};
  }
  Result<void> make(const VideoEncoder::Asked& asked, std::stop_token stop = {}) {
    auto encoder = VideoEncoder::start(asked, clock, std::move(stop));
    if (!encoder) return tl::unexpected(encoder.error());
    // Sends far more than the socket takes without a reader
    const std::vector<std::uint8_t> picture(64 * 64 * 3, 7);
    for (int i = 0; i < 200; ++i)
      if (auto added = (*encoder)->add(picture); !added) return added;
    return (*encoder)->finish();
  }
  bool program_runs() const {
    pid_t pid = 0;
    std::ifstream(folder / "pid") >> pid;
    return pid > 0 && ::kill(pid, 0) == 0;
  }

  const SystemClock clock;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("video-" + std::to_string(::getpid()));
};

TEST_F(VideoEncoding, GetsEveryByteOfEveryPicture) {
  const auto asked = program("cat > " + (folder / "got").string());
  ASSERT_TRUE(make(asked));
  EXPECT_EQ(std::filesystem::file_size(folder / "got"), 200u * 64 * 64 * 3);
  EXPECT_FALSE(program_runs());
}

TEST_F(VideoEncoding, EncoderOutputIsTheError) {
  const auto made = make(program("cat > /dev/null; echo 'Unknown encoder' >&2; exit 3"));
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, HasSubstr("Unknown encoder"));
}

TEST_F(VideoEncoding, EncoderThatDiesIsAnError) {
  const auto made = make(program("head -c 1000 > /dev/null; kill -9 $$"));
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, HasSubstr("signal 9"));
}

TEST_F(VideoEncoding, EncoderThatHitsItsSizeLimitReportsATooLargeVideo) {
  const auto made = make(program("head -c 1000 > /dev/null"));
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, HasSubstr("more than 1000 bytes"));
}

// The program writes more messages than a pipe holds without a reader
TEST_F(VideoEncoding, EndlessOutputOfTheEncoderIsRead) {
  const auto made =
      make(program("i=0; while [ $i -lt 3000 ]; do echo 'a line of forty characters or so, again' >&2; "
                   "i=$((i+1)); done; cat > /dev/null; exit 1"));
  ASSERT_FALSE(made);
  EXPECT_LT(made.error().message.size(), 3000u);
  EXPECT_THAT(made.error().message, HasSubstr("a line of forty"));
}

TEST_F(VideoEncoding, EncoderThatReadsNothingIsKilled) {
  auto asked = program("exec sleep 3600");
  asked.stall_limit = std::chrono::milliseconds(50);
  const auto made = make(asked);
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, HasSubstr("made no progress"));
  EXPECT_FALSE(program_runs());
}

TEST_F(VideoEncoding, EncoderThatDoesNotEndIsKilled) {
  auto asked = program("cat > /dev/null; exec sleep 3600");
  asked.stall_limit = std::chrono::milliseconds(500);
  ASSERT_FALSE(make(asked));
  EXPECT_FALSE(program_runs());
}

TEST_F(VideoEncoding, EncoderIsKilledAtItsTimeLimit) {
  auto asked = program("exec sleep 3600");
  asked.until = clock.now();
  const auto made = make(asked);
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, HasSubstr("time for one video is up"));
  EXPECT_FALSE(program_runs());
}

TEST_F(VideoEncoding, EncoderIsKilledWhenTheCoordinatorStops) {
  std::stop_source source;
  const auto asked = program("exec sleep 3600");
  std::jthread stops([&source] { source.request_stop(); });
  ASSERT_FALSE(make(asked, source.get_token()));
  EXPECT_FALSE(program_runs());
}

TEST_F(VideoEncoding, MissingEncoderIsAnError) {
  VideoEncoder::Asked asked = program("");
  asked.ffmpeg = (folder / "nowhere").string();

  const auto made = make(asked);

  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, Errc::not_found);
  EXPECT_EQ(made.error().message, "cannot start " + asked.ffmpeg + ": No such file or directory");
}

TEST_F(VideoEncoding, EncoderErrorsAreSafeToShow) {
  const auto made = make(program("echo 'no \033[31mcodec' >&2; exit 3"));

  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().message, "ffmpeg made no video: no  [31mcodec ");
}

}  // namespace
}  // namespace ls::coordinator
