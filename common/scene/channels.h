// The channels of Mitsuba's integrator "aov" by their names, and what they are called here
// (common/image/aov.h).
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace ls::scene {

struct ChannelRow {
  std::string_view theirs, ours;  // ours empty: there is no such output
  bool mitsuba = true;            // false: the dialect has no such channel; `convert` writes it by our name
};
std::span<const ChannelRow> channels();
const ChannelRow* channel_row(std::string_view theirs);  // nullptr: there is none of that name

// "depth,normal", names of ours -> "depth:depth,normal:sh_normal".
std::string mitsuba_channels(std::string_view aovs);

}  // namespace ls::scene
