// A job's progress on a terminal: one line that is overwritten.
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
  std::string trouble;      // why the job is waiting, if it is
  std::string frames = {};  // for sequences: "3 of 10 frames"
  std::optional<std::pair<double, double>> eta_ci95 = {};
  std::optional<std::pair<double, double>> relmse_ci95 = {};
  std::optional<double> target_error = {};   // requested relMSE
  std::optional<double> eta_with_more = {};  // time left with `more_workers` more
  int more_workers = 8;
  bool doubtful = false;  // the error is not reliable yet, nor is the time to a target
};
// Returns the line for the terminal: " 42 % [######          ] 26.9 spp  3.1 M samples/s  relMSE 0.0123
// (0.0118 to 0.0129), target 0.001  4:12 left (3:06 to 5:30), 1:06 with 8 more". If it is longer than
// `columns`, whole parts are omitted, in this order: the rate, the effect of more workers, the error's
// interval, the bar, the forecast's interval, the target. The line of a doubtful job has no intervals but
// "don't trust yet" and, with a target, "at least 4:12 left", which are never omitted.
std::string progress_line(const ProgressFigures& figures, int columns);

// Draws the line on stderr, only if stderr is a terminal.
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
