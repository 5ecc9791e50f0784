// Diagnostics of a scene that is read once per frame. A diagnostic of all frames is reported once; any other,
// such as a file that is missing in some frames, is reported with the frames that have it.
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
  // Adds the diagnostics found in a frame; there may be none.
  void add(std::uint32_t frame, const std::vector<Diagnostic>& found);
  // True if there are as many distinct diagnostics as will be shown, so that no further frames need to be
  // read.
  bool full() const { return all_.size() >= kMost; }
  bool empty() const { return all_.empty(); }
  // Returns the distinct diagnostics in order of appearance. If not all frames have a diagnostic, its text
  // begins with "frame 5: " or "frame 5 and 3 more: ".
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
