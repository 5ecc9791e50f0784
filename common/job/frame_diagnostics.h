// Diagnostics of a scene that is read once per frame: reported once if all frames share them, otherwise by
// frame (such as a file missing in the middle).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "common/scene/diagnostic.h"

namespace ls {

class FrameDiagnostics {
 public:
  // Adds the diagnostics of a frame, possibly none.
  void add(std::uint32_t frame, const std::vector<Diagnostic>& found);
  // As many distinct ones as are ever shown: no need to read on.
  bool full() const { return all_.size() >= kMost; }
  bool empty() const { return all_.empty(); }
  // In order of appearance. The text of one that not all frames share begins with "frame 5: " or "frame 5 and
  // 3 more: ".
  std::vector<Diagnostic> take() const;

 private:
  static constexpr std::size_t kMost = 20;
  struct Reported {
    Diagnostic diagnostic;
    std::uint32_t first_frame = 0, frames = 0;
  };
  using Key = std::tuple<Diagnostic::Severity, std::string, int, int, std::string>;
  std::vector<Reported> all_;
  std::map<Key, std::size_t> known_;
  std::uint32_t read_ = 0;
};

}  // namespace ls
