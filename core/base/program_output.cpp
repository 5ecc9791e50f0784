#include "core/base/program_output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/log.h"
#include "core/base/safe_text.h"

namespace ls {
namespace {

constexpr int kSlowlyMs = 10;  // pause between reads of a program that writes too much

}  // namespace

bool LineBudget::spend(TimePoint now) {
  const std::lock_guard lock(mutex_);
  if (now > at_) {
    left_ = std::min(kBurst, left_ + seconds(now - at_) * kPerSecond);
    at_ = now;
  }
  if (left_ < 1) return false;
  left_ -= 1;
  return true;
}

std::vector<std::string> OutputLines::take(std::string_view bytes, TimePoint now) {
  std::vector<std::string> lines;
  while (!bytes.empty()) {
    const std::size_t length = std::min(bytes.find('\n'), bytes.size());
    const std::size_t kept = std::min(length, kLineBytes - line_.size());
    line_ += bytes.substr(0, kept);
    cut_ = cut_ || kept < length;
    if (length < bytes.size()) finish_line(now, lines);
    bytes.remove_prefix(std::min(bytes.size(), length + 1));
  }
  return lines;
}

std::vector<std::string> OutputLines::end(TimePoint now) {
  std::vector<std::string> lines;
  finish_line(now, lines);
  report_left_out(lines);
  return lines;
}

void OutputLines::finish_line(TimePoint now, std::vector<std::string>& lines) {
  std::string line = plain_text(std::exchange(line_, {}));
  if (std::exchange(cut_, false)) line += " ...";
  if (line.find_first_not_of(' ') == std::string::npos) return;
  last_ = line;
  if (!budget_.spend(now)) {
    ++left_out_;
    return;
  }
  report_left_out(lines);
  lines.push_back(std::move(line));
}

void OutputLines::report_left_out(std::vector<std::string>& lines) {
  if (const auto count = std::exchange(left_out_, 0); count > 0)
    lines.push_back(fmt::format("({} lines are left out here: it wrote too many)", count));
}

Result<std::unique_ptr<ProgramOutput>> ProgramOutput::open(std::string name, LineBudget& budget) {
  std::unique_ptr<ProgramOutput> output(new ProgramOutput(std::move(name), budget));
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0)
    return fail(
        Errc::internal,
        fmt::format("cannot make a pipe for the output of {}: {}{}", output->name_, std::strerror(errno),
                    errno == EMFILE ? "; raise the limit of open files (ulimit -n)" : ""));
  output->read_ = ends[0], output->write_ = ends[1];
  ::fcntl(output->read_, F_SETFL, O_NONBLOCK);
  return output;
}

ProgramOutput::~ProgramOutput() {
  close_write_end();
  if (read_ >= 0) ::close(read_);
}

void ProgramOutput::close_write_end() {
  if (write_ >= 0) ::close(std::exchange(write_, -1));
}

bool ProgramOutput::read(int milliseconds) {
  pollfd waiting{read_, POLLIN, 0};
  if (::poll(&waiting, 1, milliseconds) <= 0) return true;
  std::array<char, 16 << 10> bytes;
  const ssize_t count = ::read(read_, bytes.data(), bytes.size());
  if (count < 0) return errno == EINTR || errno == EAGAIN;
  log(lines_.take({bytes.data(), static_cast<std::size_t>(count)}, clock_.now()));
  // The program then waits for room in the pipe, and this process keeps its time for its own work.
  if (lines_.leaves_out()) ::poll(nullptr, 0, kSlowlyMs);
  return count > 0;
}

std::string ProgramOutput::end() {
  // No more than the pipe holds: descendants of the program may write on without end.
  for (int reads = 0; reads < 4 && read(0); ++reads) {
  }
  log(lines_.end(clock_.now()));
  return lines_.last();
}

void ProgramOutput::log(const std::vector<std::string>& lines) const {
  for (const std::string& line : lines) log_warn("program=" + log_value(name_), "wrote: " + line);
}

}  // namespace ls
