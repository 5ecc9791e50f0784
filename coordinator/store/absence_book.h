// When a coordinator counts as gone: when it was not alive at so many looks, one right after the other. Looks
// are counted, not seconds: after a pause of our own, or of Redis, the counting begins again, and nobody is
// taken for dead because it was we who slept.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace ls::coordinator {

class AbsenceBook {
 public:
  explicit AbsenceBook(int looks) : looks_(looks) {}

  // `known`: all there are, and whether each is alive. Those that are gone by now.
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
  // What was seen before cannot be gone on from.
  void begin_again() { absent_.clear(); }

 private:
  int looks_;
  std::map<std::string, int> absent_;  // looks without a sign of life
};

}  // namespace ls::coordinator
