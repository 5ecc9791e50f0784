// Maps the channels of Mitsuba's integrator "aov" to our AOV names (common/image/aov/aov.h).
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace ls::scene {

struct ChannelRow {
  std::string_view theirs, ours;  // `ours` empty: not supported
  bool mitsuba = true;            // false: the dialect has no such channel; `convert` writes it by our name
};
std::span<const ChannelRow> channels();
const ChannelRow* channel_row(std::string_view theirs);  // nullptr: unknown name

// Converts a list of our names to channels of Mitsuba: "depth,normal" -> "depth:depth,normal:sh_normal".
std::string mitsuba_channels(std::string_view aovs);

}  // namespace ls::scene
