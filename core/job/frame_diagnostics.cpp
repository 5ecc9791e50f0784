#include "core/job/frame_diagnostics.h"

#include <fmt/format.h>

namespace ls {

void FrameDiagnostics::add(std::uint32_t frame, const std::vector<Diagnostic>& found) {
  ++read_;
  for (const Diagnostic& d : found) {
    const Key key{d.severity, d.place.file, d.place.line, d.place.column, d.text};
    const auto known = known_.find(key);
    if (known != known_.end()) {
      ++all_[known->second].frames;
    } else if (!full()) {
      known_.emplace(key, all_.size());
      all_.push_back({d, frame, 1});
    }
  }
}

std::vector<Diagnostic> FrameDiagnostics::take() const {
  std::vector<Diagnostic> out;
  for (const Reported& reported : all_) {
    Diagnostic d = reported.diagnostic;
    if (reported.frames < read_ || read_ == 1)
      d.text = reported.frames == 1 ? fmt::format("frame {}: {}", reported.first_frame, d.text)
                                    : fmt::format("frame {} and {} more: {}", reported.first_frame,
                                                  reported.frames - 1, d.text);
    out.push_back(std::move(d));
  }
  return out;
}

}  // namespace ls
