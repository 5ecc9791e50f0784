// Jobs that are announced: `lightshaft submit --after-file` submits them once the files that it waits for are
// complete on the user's machine. Until then the farm knows only what the command says of them.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/base/clock.h"
#include "core/base/error.h"

namespace ls::http {

struct AnnouncedJob {
  std::string name;                // of the scene
  std::string machine;             // where the files are waited for
  std::string frames;              // of a sequence, as in a JobSpec; empty: a single image
  std::vector<std::string> files;  // the first of the files that are not complete
  std::uint64_t count = 0;         // of all files that are not complete
  std::string owner;
  double since_unix = 0;  // when it was first announced, in seconds since 1970
};

// Thread-safe. In memory only: after a restart the commands announce their jobs again.
class AnnouncedJobs {
 public:
  // An announcement is forgotten if it is not repeated within this time: its command has ended.
  static constexpr Duration kLife = std::chrono::seconds(60);
  static constexpr std::size_t kMostEach = 200;  // announcements of one user
  static constexpr std::size_t kMost = 5000;
  static constexpr std::size_t kFilesShown = 5;  // files that are named

  // Adds or repeats an announcement. already_exists: another user has one with this id. resource_exhausted:
  // there are too many.
  Result<void> announce(const std::string& id, AnnouncedJob job, TimePoint now) {
    const std::lock_guard lock(mutex_);
    forget(now);
    const auto known = jobs_.find(id);
    if (known != jobs_.end()) {
      if (known->second.job.owner != job.owner)
        return fail(Errc::already_exists, "another user has announced a job with this id");
      job.since_unix = known->second.job.since_unix;
      known->second = {std::move(job), now + kLife};
      return {};
    }
    const auto own = std::count_if(jobs_.begin(), jobs_.end(),
                                   [&](const auto& each) { return each.second.job.owner == job.owner; });
    if (static_cast<std::size_t>(own) >= kMostEach || jobs_.size() >= kMost)
      return fail(Errc::resource_exhausted, "too many jobs are announced");
    jobs_.emplace(id, Entry{std::move(job), now + kLife});
    return {};
  }

  // Returns all announcements with their ids, the oldest first.
  std::vector<std::pair<std::string, AnnouncedJob>> list(TimePoint now) {
    const std::lock_guard lock(mutex_);
    forget(now);
    std::vector<std::pair<std::string, AnnouncedJob>> all;
    for (const auto& [id, entry] : jobs_) all.emplace_back(id, entry.job);
    std::stable_sort(all.begin(), all.end(),
                     [](const auto& a, const auto& b) { return a.second.since_unix < b.second.since_unix; });
    return all;
  }

  // Withdraws an announcement. Returns false if this user has none with this id.
  bool withdraw(const std::string& id, const std::string& owner) {
    const std::lock_guard lock(mutex_);
    const auto known = jobs_.find(id);
    if (known == jobs_.end() || known->second.job.owner != owner) return false;
    jobs_.erase(known);
    return true;
  }

 private:
  struct Entry {
    AnnouncedJob job;
    TimePoint until;
  };
  void forget(TimePoint now) {
    std::erase_if(jobs_, [now](const auto& each) { return each.second.until <= now; });
  }

  std::mutex mutex_;
  std::map<std::string, Entry> jobs_;
};

}  // namespace ls::http
