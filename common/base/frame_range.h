// The frames of a sequence: "1-10", "1-10x2" (every second one), "7". In file names a run of # stands for the
// frame number, zero-padded to the run's length.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"

namespace ls {

inline constexpr std::uint32_t kMaxFrameNumber = 9'999'999;
inline constexpr std::uint32_t kMaxFrames = 10'000;  // of one sequence

struct FrameRange {
  std::uint32_t first = 0, last = 0;  // both included
  std::uint32_t step = 1;
  std::uint32_t count() const { return (last - first) / step + 1; }
  bool contains(std::uint32_t frame) const {
    return frame >= first && frame <= last && (frame - first) % step == 0;
  }
  std::vector<std::uint32_t> frames() const;  // ascending
  bool operator==(const FrameRange&) const = default;
};

// invalid_argument: the message has the text, the correct syntax and any limit exceeded.
Result<FrameRange> parse_frames(std::string_view text);
std::string to_string(const FrameRange& range);

// "fog.####.vdb" of frame 7 is "fog.0007.vdb"; every run of # is replaced. A number longer than its run is
// written in full.
std::string numbered(std::string_view name, std::uint32_t frame);
bool has_frame_number(std::string_view name);  // true if it contains a #

}  // namespace ls
