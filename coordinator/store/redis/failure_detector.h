// Decides which coordinators count as dead: those that showed no sign of life in `looks` consecutive polls.
// It counts polls, not seconds, and begins to count again after this process or Redis was stopped for a
// while, so that such a pause does not count against the others.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace ls::coordinator {

class FailureDetector {
 public:
  explicit FailureDetector(int looks) : looks_(looks) {}

  // `known`: all coordinators, and whether each is alive. Returns those that count as dead.
  std::vector<std::string> look(const std::map<std::string, bool>& known) {
    std::map<std::string, int> now;
    std::vector<std::string> gone;
    for (const auto& [name, alive] : known) {
      if (alive) continue;
      const auto before = absent_.find(name);
      const int times = (before == absent_.end() ? 0 : before->second) + 1;
      now.emplace(name, times);
      if (times >= looks_) gone.push_back(name);
    }
    absent_ = std::move(now);
    return gone;
  }
  // Forgets all earlier polls.
  void begin_again() { absent_.clear(); }

 private:
  int looks_;
  std::map<std::string, int> absent_;  // consecutive polls without a sign of life, per coordinator
};

}  // namespace ls::coordinator
