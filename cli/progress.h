// A job's progress on a terminal: one line that is written over.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace ls::cli {

struct ProgressFigures {
  std::string state;    // "running", ...
  double progress = 0;  // 0..1
  double spp_done = 0;  // mean over pixels
  double samples_per_second = 0;
  std::optional<double> relmse;
  std::optional<double> eta_seconds;
  std::string trouble;      // why it waits
  std::string frames = {};  // of a sequence: "3 of 10 frames"
  std::optional<std::pair<double, double>> eta_ci95 = {};
};
// " 42 % [########          ] 26.9 spp  3.1 M samples/s  relMSE 0.0123  0:42 left"
std::string progress_line(const ProgressFigures& figures, int columns);

// Writes to stderr, only if that is a terminal.
class ProgressBar {
 public:
  explicit ProgressBar(bool quiet);
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  bool shown() const { return shown_; }
  void show(const ProgressFigures& figures);
  void clear();

 private:
  bool shown_;
  bool dirty_ = false;
};

}  // namespace ls::cli
