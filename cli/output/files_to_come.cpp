#include "cli/output/files_to_come.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <set>
#include <thread>

#include "core/base/clock.h"

namespace ls::cli {
namespace {

constexpr std::chrono::seconds kPause{1};  // between two looks

tl::unexpected<Error> bad_pattern(fmt::format_string<const std::string&> why, const std::string& pattern) {
  return tl::unexpected(Error{Errc::invalid_argument, "--after-file " + fmt::format(why, pattern)});
}

}  // namespace

std::optional<FileState> file_state(const std::string& path) {
  struct stat found;
  if (::stat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return {};
  return FileState{static_cast<std::uint64_t>(found.st_size),
                   found.st_mtim.tv_sec * 1'000'000'000LL + found.st_mtim.tv_nsec};
}

Result<FilesToCome> FilesToCome::of(const std::vector<std::string>& patterns,
                                    const std::optional<FrameRange>& frames) {
  FilesToCome files;
  std::set<std::string> known;
  const auto add = [&](const std::string& path) {
    if (known.insert(path).second) files.files_.push_back(path);
  };
  for (const std::string& pattern : patterns) {
    std::error_code error;
    if (std::filesystem::is_directory(pattern, error))
      return bad_pattern("{}: that is a folder; name the last file that is written to it", pattern);
    const bool numbered_name = has_frame_number(pattern) && !std::filesystem::exists(pattern, error);
    if (!numbered_name)
      add(pattern);
    else if (frames)
      for (const std::uint32_t frame : frames->frames()) add(numbered(pattern, frame));
    else
      return bad_pattern("{}: # stands for the frame number, and there are no --frames", pattern);
  }
  return files;
}

std::vector<std::string> FilesToCome::look(
    double now, const std::function<std::optional<FileState>(const std::string&)>& state) {
  std::vector<std::string> incomplete;
  for (const std::string& path : files_) {
    const auto found = state(path);
    if (!found || found->bytes == 0) {
      seen_.erase(path);
      incomplete.push_back(path);
      continue;
    }
    const auto [seen, fresh] = seen_.try_emplace(path, Seen{*found, now});
    if (!fresh && seen->second.state != *found) seen->second = {*found, now};
    if (now - seen->second.since < kQuietSeconds) incomplete.push_back(path);
  }
  return incomplete;
}

std::string waits_for(const std::vector<std::string>& files) {
  return files.size() == 1 ? fmt::format("waits for {}", files.front())
                           : fmt::format("waits for {} files, the first is {}", files.size(), files.front());
}

Result<void> wait_for_files(const std::vector<std::string>& patterns, const std::optional<FrameRange>& frames,
                            const std::function<Result<void>(const std::vector<std::string>&)>& waiting) {
  auto files = FilesToCome::of(patterns, frames);
  if (!files) return tl::unexpected(files.error());
  const SystemClock clock;
  const TimePoint begin = clock.now();
  std::vector<std::string> last;
  double repeat_at = 0;
  for (;; std::this_thread::sleep_for(kPause)) {
    const double now = seconds(clock.now() - begin);
    auto incomplete = files->look(now, file_state);
    if (incomplete.empty()) return {};
    if (incomplete == last && now < repeat_at) continue;
    last = std::move(incomplete);
    repeat_at = now + kRepeatSeconds;
    if (auto ok = waiting(last); !ok) return ok;
  }
}

}  // namespace ls::cli
