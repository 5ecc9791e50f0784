#include "cli/output/console.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <new>
#include <system_error>

#include "core/base/safe_text.h"

namespace ls::cli {
namespace {

bool input_at_fault(Errc code) { return code == Errc::invalid_argument; }

}  // namespace

void print_note(const std::string& line) { fmt::print(stderr, "{}\n", plain_text(line)); }

void print(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

void complain(const std::string& text) { print_note("lightshaft: error: " + text); }

int usage_error(const std::string& text) {
  complain(text);
  return kUsage;
}

int print_error(const Error& error) {
  complain(error.message);
  return input_at_fault(error.code) ? kUsage : kFailed;
}

int print_rejected(const coordinator::Rejected& rejected) {
  print_diagnostics(rejected.diagnostics);
  if (rejected.diagnostics.empty()) complain(rejected.error.message);
  return input_at_fault(rejected.error.code) || !rejected.diagnostics.empty() ? kUsage : kFailed;
}

void print_diagnostics(const std::vector<Diagnostic>& diagnostics) {
  if (!diagnostics.empty()) fmt::print(stderr, "{}", format_diagnostics(diagnostics));
}

int run_guarded(const std::string& command, const std::function<int()>& action) {
  try {
    return action();
  } catch (const std::system_error& e) {
    // Whoever read the output has enough of it: `lightshaft jobs | head`
    if (e.code() == std::errc::broken_pipe) return kOk;
    complain("`" + command + "` failed: " + e.what());
  } catch (const std::bad_alloc&) {
    complain("out of memory in `" + command + "`");
  } catch (const std::exception& e) {
    complain("`" + command + "` failed: " + e.what());
  }
  return kFailed;
}

std::string aligned(const std::vector<std::vector<std::string>>& rows, const std::string& indent) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line = indent;
    for (std::size_t i = 0; i < row.size(); ++i)
      line += fmt::format("{:<{}}", row[i], i + 1 < row.size() ? widths[i] + 2 : 0);
    line.erase(line.find_last_not_of(' ') + 1);
    out += (out.empty() ? "" : "\n") + line;
  }
  return out;
}

std::string show_bytes(std::uint64_t bytes) {
  constexpr std::array kUnits{"B", "KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 1024 && unit + 1 < kUnits.size()) value /= 1024, ++unit;
  return unit == 0 ? fmt::format("{} B", bytes) : fmt::format("{:.1f} {}", value, kUnits[unit]);
}

std::string show_seconds(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0) return "?";
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  if (seconds < 59.5) return fmt::format("{:.0f} s", seconds);
  if (seconds > 1e15) return "for ever";
  const auto s = static_cast<long long>(std::llround(seconds));
  return s < 3600 ? fmt::format("{}:{:02}", s / 60, s % 60)
                  : fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

}  // namespace ls::cli
