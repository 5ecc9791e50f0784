// A job's progress on a terminal: one line that is overwritten.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace ls::cli {

struct ProgressFigures {
  std::string state;    // state of the job, such as "running"
  double progress = 0;  // from 0 to 1
  double spp_done = 0;  // samples per pixel, mean over pixels
  double samples_per_second = 0;
  std::optional<double> relmse;
  std::optional<double> eta_seconds;
  std::string trouble;      // why the job waits; empty: it does not wait
  std::string frames = {};  // for sequences: "3 of 10 frames"
  std::optional<std::pair<double, double>> eta_ci95 = {};
  std::optional<std::pair<double, double>> relmse_ci95 = {};
  std::optional<double> target_error = {};   // requested target, in relMSE
  std::optional<double> eta_with_more = {};  // remaining time with `more_workers` additional workers
  int more_workers = 8;
  bool doubtful = false;         // neither the error nor the time left to a target error is reliable yet
  bool target_denoised = false;  // target_error is for the error of the denoised layers
  // Upper end of the interval that the most recent check gave for the relMSE of the denoised layers
  std::optional<double> denoised_at_most = {};
};
// Returns the line for the terminal: " 42 % [######          ] 26.9 spp  3.1 M samples/s  relMSE 0.0123
// (0.0118 to 0.0129), target 0.001  4:12 left (3:06 to 5:30), 1:06 with 8 more". If it is longer than
// `columns`, whole parts are omitted, in this order: the rate, the effect of more workers, the error's
// interval, the bar, the forecast's interval, the target. In the line of a doubtful job, "don't trust yet"
// replaces the intervals and, if there is a target, "at least 4:12 left" replaces the remaining time; these
// two texts are never omitted. If the target is for the denoised layers, the line has ", denoised at most
// 0.0012, target 0.001". `columns` 0: any length.
std::string progress_line(const ProgressFigures& figures, int columns, bool with_bar = true);

enum class ProgressForm {
  none,
  bar,    // one line that is overwritten; nothing if stderr is not a terminal
  lines,  // for logs and programs: a line without bar whenever the whole percent has changed
};

// Shows progress_line() on stderr, in the given form.
class ProgressBar {
 public:
  explicit ProgressBar(ProgressForm form);
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  bool shown() const { return shown_; }
  void show(const ProgressFigures& figures);
  void clear();

 private:
  ProgressForm form_;
  bool shown_;
  bool dirty_ = false;
  std::optional<double> percent_ = {};  // percent of the last line printed, for ProgressForm::lines
};

}  // namespace ls::cli
