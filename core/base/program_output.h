// Turns what another program writes to its standard output and standard error into lines of this program's
// log. The other program may be under the control of whoever made its input. So it gets a pipe instead of our
// log file or terminal, and its lines are cleaned, shortened, marked as its own and limited in number.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/clock.h"
#include "core/base/error.h"

namespace ls {

// How many lines other programs may still write to our log: kBurst at once and kPerSecond in the long run,
// which is about 9 MB a day. Programs that follow each other share one budget.
class LineBudget {
 public:
  static constexpr double kBurst = 200, kPerSecond = .1;
  bool spend(TimePoint now);  // false: no line is left

 private:
  std::mutex mutex_;
  double left_ = kBurst;
  TimePoint at_{};
};

// Cuts the bytes of one program into lines. It has no clock and logs nothing itself.
class OutputLines {
 public:
  static constexpr std::size_t kLineBytes = 1000;  // of a longer line the rest is left out

  explicit OutputLines(LineBudget& budget) : budget_(budget) {}
  // Returns the lines that are complete now and within the budget, cleaned by plain_text(). Lines beyond the
  // budget are counted, and a line says later how many they were.
  std::vector<std::string> take(std::string_view bytes, TimePoint now);
  // The same at the program's end: its last line needs no line feed.
  std::vector<std::string> end(TimePoint now);
  bool leaves_out() const { return left_out_ > 0; }  // true: the last line was beyond the budget
  const std::string& last() const { return last_; }  // the last line that was not empty, cleaned

 private:
  void finish_line(TimePoint now, std::vector<std::string>& lines);
  void report_left_out(std::vector<std::string>& lines);

  LineBudget& budget_;
  std::string line_, last_;
  bool cut_ = false;  // true: the present line is longer than kLineBytes
  std::uint64_t left_out_ = 0;
};

// A pipe for the output of one program, and the log of what comes out of it.
class ProgramOutput {
 public:
  // `name` names the program in the log. Errors: internal, with the system's reason.
  static Result<std::unique_ptr<ProgramOutput>> open(std::string name, LineBudget& budget);
  ~ProgramOutput();
  ProgramOutput(const ProgramOutput&) = delete;
  ProgramOutput& operator=(const ProgramOutput&) = delete;

  // The descriptor for the program to write to. Call close_write_end() once the program has been started.
  int write_end() const { return write_; }
  void close_write_end();
  // Waits at most `milliseconds` for output, and logs it. A program that writes too much is read slowly.
  // Returns false if nobody can write to the pipe any more.
  bool read(int milliseconds);
  // Logs what is left. Returns the last line that the program wrote; empty: it wrote none.
  std::string end();

 private:
  ProgramOutput(std::string name, LineBudget& budget) : name_(std::move(name)), lines_(budget) {}
  void log(const std::vector<std::string>& lines) const;

  const std::string name_;
  const SystemClock clock_;
  OutputLines lines_;
  int read_ = -1, write_ = -1;
};

}  // namespace ls
