// Collects the errors and warnings (diagnostics) about the scene of a sequence, which is read once for each
// frame. A diagnostic that occurs in all frames is reported once, without a frame. A diagnostic that occurs
// in some frames, such as a missing file, is reported once with the first frame and the number of others.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "core/scene/diagnostic.h"

namespace ls {

class FrameDiagnostics {
 public:
  // Adds the diagnostics `found` in frame number `frame`; to be called for every frame, also for one without
  // diagnostics.
  void add(std::uint32_t frame, const std::vector<Diagnostic>& found);
  // True if kMost distinct diagnostics have been added. No more are shown, so the caller need not read more
  // frames.
  bool full() const { return all_.size() >= kMost; }
  bool empty() const { return all_.empty(); }
  // Returns the distinct diagnostics in order of appearance. If a diagnostic did not occur in all frames, its
  // text begins with "frame 5: " or "frame 5 and 3 more: ".
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
