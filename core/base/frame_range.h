// The frames of a sequence (a job that renders one image per frame), as text: "1-10", "1-10x2" (every second
// frame), "7". In the last component of a path a run of # is replaced by the frame number, zero-padded to the
// run's length.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace ls {

inline constexpr std::uint32_t kMaxFrameNumber = 9'999'999;
inline constexpr std::uint32_t kMaxFrames = 10'000;  // largest number of frames in one sequence

struct FrameRange {
  std::uint32_t first = 0, last = 0;  // ends of the range; `last` is included if a step reaches it
  std::uint32_t step = 1;
  std::uint32_t count() const { return (last - first) / step + 1; }
  bool contains(std::uint32_t frame) const {
    return frame >= first && frame <= last && (frame - first) % step == 0;
  }
  std::vector<std::uint32_t> frames() const;  // returns the numbers in ascending order
  bool operator==(const FrameRange&) const = default;
};

// Parses a range of frames. Returns invalid_argument if `text` is not a valid range. The message quotes the
// text and contains the correct syntax and any limit that is exceeded.
Result<FrameRange> parse_frames(std::string_view text);
std::string to_string(const FrameRange& range);

// Returns the path `name` with every run of # in its last component replaced by the frame number:
// "shot#3/fog.####.vdb" of frame 7 is "shot#3/fog.0007.vdb". If the last component has none, runs of two and
// more in the names of folders are replaced: "frame_####/fog.vdb". A number with more digits than its run is
// written in full.
std::string numbered(std::string_view name, std::uint32_t frame);
bool has_frame_number(std::string_view name);  // true if numbered() replaces anything

}  // namespace ls
