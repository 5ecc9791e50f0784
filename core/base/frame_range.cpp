#include "core/base/frame_range.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "core/base/safe_text.h"

namespace ls {
namespace {

constexpr std::size_t kMostShown = 40;  // a message quotes at most this many characters of an invalid text

// Parses a number at the front of `text` and removes it from `text`.
std::optional<std::uint32_t> take_number(std::string_view& text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

bool take(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) return false;
  text.remove_prefix(1);
  return true;
}

std::optional<FrameRange> read(std::string_view text) {
  const auto first = take_number(text);
  if (!first) return std::nullopt;
  FrameRange range{*first, *first, 1};
  if (take(text, '-')) {
    const auto last = take_number(text);
    if (!last) return std::nullopt;
    range.last = *last;
    if (take(text, 'x')) {
      const auto step = take_number(text);
      if (!step) return std::nullopt;
      range.step = *step;
    }
  }
  if (!text.empty()) return std::nullopt;
  return range;
}

}  // namespace

std::vector<std::uint32_t> FrameRange::frames() const {
  std::vector<std::uint32_t> all;
  all.reserve(count());
  for (std::uint32_t i = 0; i < count(); ++i) all.push_back(first + i * step);
  return all;
}

Result<FrameRange> parse_frames(std::string_view text) {
  const auto wrong = [&](std::string why) {
    return bad_argument(fmt::format("frames '{}': {}", plain_text(text.substr(0, kMostShown)), why));
  };
  const auto range = read(text);
  if (!range)
    return wrong(
        "write them as FIRST-LAST, for example 1-10; 1-10x2 is every second frame, 7 only the seventh");
  if (range->last < range->first) return wrong("the last comes before the first");
  if (range->step == 0) return wrong("a step of 0 never arrives");
  if (range->last > kMaxFrameNumber) return wrong(fmt::format("numbers go up to {}", kMaxFrameNumber));
  if (range->count() > kMaxFrames)
    return wrong(fmt::format("these are {} frames; one job may have {}: make several jobs of it",
                             range->count(), kMaxFrames));
  return *range;
}

std::string to_string(const FrameRange& range) {
  std::string text = fmt::format("{}", range.first);
  if (range.last != range.first) text += fmt::format("-{}", range.last);
  if (range.last != range.first && range.step != 1) text += fmt::format("x{}", range.step);
  return text;
}

namespace {

// Where the last component of a path begins.
std::size_t file_begins(std::string_view name) {
  const std::size_t end = name.find_last_not_of('/');
  const std::size_t slash = end == std::string_view::npos ? end : name.rfind('/', end);
  return slash == std::string_view::npos ? 0 : slash + 1;
}

// Where and as what # stands for the frame's number: in the last component of the path; if that has none, as
// two or more in the names of folders. One # in the name of a folder ("shot#3") is only a #.
struct Hashes {
  explicit Hashes(std::string_view name) {
    first = file_begins(name);
    if (name.find('#', first) == std::string_view::npos) first = 0, shortest = 2;
  }
  std::size_t first = 0, shortest = 1;
};

}  // namespace

std::string numbered(std::string_view name, std::uint32_t frame) {
  const Hashes hashes(name);
  std::string out(name.substr(0, hashes.first));
  for (std::size_t at = hashes.first; at < name.size();) {
    if (name[at] != '#') {
      out += name[at++];
      continue;
    }
    const std::size_t end = std::min(name.find_first_not_of('#', at), name.size());
    const bool stands = end - at >= hashes.shortest;
    out += stands ? fmt::format("{:0{}}", frame, end - at) : std::string(name.substr(at, end - at));
    at = end;
  }
  return out;
}

bool has_frame_number(std::string_view name) {
  const Hashes hashes(name);
  return name.find(std::string(hashes.shortest, '#'), hashes.first) != std::string_view::npos;
}

}  // namespace ls
