// What is wrong with a scene that is read once per frame: told once where all frames share it, and by frame
// where they don't (a file that is missing in the middle).
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
  // A frame that was read, with or without complaints.
  void add(std::uint32_t frame, const std::vector<Diagnostic>& found);
  // As many different ones as are ever shown: reading on would tell nobody more.
  bool full() const { return all_.size() >= kMost; }
  bool empty() const { return all_.empty(); }
  // In order of appearance. Of one that not all frames have the text begins with "frame 5: " or
  // "frame 5 and 3 more: ".
  std::vector<Diagnostic> take() const;

 private:
  static constexpr std::size_t kMost = 20;
  struct Told {
    Diagnostic diagnostic;
    std::uint32_t first_frame = 0, frames = 0;
  };
  using Key = std::tuple<Diagnostic::Severity, std::string, int, int, std::string>;
  std::vector<Told> all_;
  std::map<Key, std::size_t> known_;
  std::uint32_t read_ = 0;
};

}  // namespace ls
