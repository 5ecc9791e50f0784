#include "cli/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "cli/say.h"
#include "common/base/plain_text.h"

namespace ls::cli {
namespace {

constexpr int kBarCells = 16;
constexpr int kNarrowestWithBar = 70;  // columns of the terminal

std::string show_rate(double per_second) {
  constexpr std::array kUnits{"", " k", " M", " G"};
  std::size_t unit = 0;
  while (per_second >= 1000 && unit + 1 < kUnits.size()) per_second /= 1000, ++unit;
  return fmt::format("{:.3g}{} samples/s", per_second, kUnits[unit]);
}

int terminal_columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

std::string progress_line(const ProgressFigures& f, int columns) {
  const double part = std::isfinite(f.progress) ? std::clamp(f.progress, 0.0, 1.0) : 0;
  std::string line = fmt::format("{:3.0f} %", std::floor(100 * part));
  if (columns >= kNarrowestWithBar) {
    const int full = static_cast<int>(std::floor(kBarCells * part));
    line += fmt::format(" [{}{}]", std::string(full, '#'), std::string(kBarCells - full, ' '));
  }
  if (f.state != "running") line += " " + plain_text(f.state);
  if (!f.frames.empty()) line += " " + plain_text(f.frames);
  line += fmt::format(" {:.1f} spp", f.spp_done);
  if (f.samples_per_second > 0) line += "  " + show_rate(f.samples_per_second);
  if (f.relmse) line += fmt::format("  relMSE {:.3g}", *f.relmse);
  if (f.eta_seconds) line += fmt::format("  {} left", show_seconds(*f.eta_seconds));
  if (f.eta_seconds && f.eta_ci95)
    line += fmt::format(" ({} to {})", show_seconds(f.eta_ci95->first), show_seconds(f.eta_ci95->second));
  if (!f.trouble.empty()) line += "  " + plain_text(f.trouble);
  if (columns > 0 && line.size() >= static_cast<std::size_t>(columns))
    line.resize(static_cast<std::size_t>(columns) - 1);
  return line;
}

ProgressBar::ProgressBar(bool quiet) : shown_(!quiet && ::isatty(STDERR_FILENO) == 1) {}

void ProgressBar::show(const ProgressFigures& figures) {
  if (!shown_) return;
  fmt::print(stderr, "\r\x1b[K{}", progress_line(figures, terminal_columns()));
  std::fflush(stderr);
  dirty_ = true;
}

void ProgressBar::clear() {
  if (!dirty_) return;
  fmt::print(stderr, "\r\x1b[K");
  std::fflush(stderr);
  dirty_ = false;
}

}  // namespace ls::cli
