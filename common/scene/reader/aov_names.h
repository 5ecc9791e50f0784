// Maps the channels of Mitsuba's integrator "aov" to our AOV names (common/image/aov/aov.h).
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace ls::scene {

struct ChannelRow {
  std::string_view theirs, ours;  // `ours` is empty if the channel is not supported
  bool mitsuba = true;            // false: Mitsuba has no such channel, and `convert` writes our name
};
std::span<const ChannelRow> channels();
const ChannelRow* channel_row(std::string_view theirs);  // returns nullptr for an unknown name

// Converts a list of our names to channels of Mitsuba: "depth,normal" becomes "depth:depth,normal:sh_normal".
std::string mitsuba_channels(std::string_view aovs);

}  // namespace ls::scene
