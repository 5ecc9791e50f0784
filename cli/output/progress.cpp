#include "cli/output/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <utility>
#include <vector>

#include "cli/output/console.h"
#include "cli/output/convergence_text.h"
#include "core/base/safe_text.h"

namespace ls::cli {
namespace {

constexpr int kBarCells = 16;

std::string show_rate(double per_second) {
  constexpr std::array kUnits{"", " k", " M", " G"};
  std::size_t unit = 0;
  while (per_second >= 1000 && unit + 1 < kUnits.size()) per_second /= 1000, ++unit;
  return fmt::format("{:.3g}{} samples/s", per_second, kUnits[unit]);
}

double part_done(const ProgressFigures& f) {
  return std::isfinite(f.progress) ? std::clamp(f.progress, 0.0, 1.0) : 0;
}

struct Part {
  int rank;  // if the line is too long, the part with the highest rank is left out first; 0: never left out
  std::string text;
};

std::string fitted(std::vector<Part> parts, int columns) {
  const auto joined = [&] {
    std::string line;
    for (const Part& part : parts) line += part.text;
    return line;
  };
  const auto room = static_cast<std::size_t>(std::max(columns, 1)) - 1;
  const auto by_rank = [](const Part& a, const Part& b) { return a.rank < b.rank; };
  while (columns > 0 && joined().size() > room) {
    const auto least = std::max_element(parts.begin(), parts.end(), by_rank);
    if (least->rank == 0) return joined().substr(0, room);
    parts.erase(least);
  }
  return joined();
}

int terminal_columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

using Add = std::function<void(int rank, std::string text)>;

void add_error(const ProgressFigures& f, const Add& add) {
  if (!f.relmse) return;
  add(0, fmt::format("  relMSE {:.3g}", *f.relmse));
  if (f.doubtful) {
    add(0, fmt::format(" ({})", kDoubt));
  } else if (f.relmse_ci95) {
    add(4, fmt::format(" ({:.3g} to {:.3g})", f.relmse_ci95->first, f.relmse_ci95->second));
  }
  if (f.denoised_at_most) add(1, fmt::format(", denoised at most {:.3g}", *f.denoised_at_most));
  if (f.target_error)
    add(1, fmt::format(", target {:g}{}", *f.target_error,
                       f.target_denoised && !f.denoised_at_most ? " denoised" : ""));
}

void add_time_left(const ProgressFigures& f, const Add& add) {
  if (!f.eta_seconds) return;
  add(0, fmt::format("  {}{} left", f.doubtful && f.target_error ? "at least " : "",
                     show_seconds(*f.eta_seconds)));
  if (f.eta_ci95 && !f.doubtful)
    add(2, fmt::format(" ({} to {})", show_seconds(f.eta_ci95->first), show_seconds(f.eta_ci95->second)));
  if (f.eta_with_more)
    add(5, fmt::format(", {} with {} more", show_seconds(*f.eta_with_more), f.more_workers));
}

}  // namespace

std::string progress_line(const ProgressFigures& f, int columns, bool with_bar) {
  const double part = part_done(f);
  const int full = static_cast<int>(std::floor(kBarCells * part));
  std::vector<Part> parts;
  const auto add = [&](int rank, std::string text) { parts.push_back({rank, std::move(text)}); };
  add(0, fmt::format("{:3.0f} %", std::floor(100 * part)));
  if (with_bar) add(3, fmt::format(" [{}{}]", std::string(full, '#'), std::string(kBarCells - full, ' ')));
  if (f.state != "running") add(0, " " + plain_text(f.state));
  if (!f.frames.empty()) add(0, " " + plain_text(f.frames));
  add(0, fmt::format(" {:.1f} spp", f.spp_done));
  if (f.samples_per_second > 0) add(6, "  " + show_rate(f.samples_per_second));
  add_error(f, add);
  add_time_left(f, add);
  if (!f.trouble.empty()) add(0, "  " + plain_text(f.trouble));
  return fitted(parts, columns);
}

ProgressBar::ProgressBar(ProgressForm form)
    : form_(form),
      shown_(form == ProgressForm::lines || (form == ProgressForm::bar && ::isatty(STDERR_FILENO) == 1)) {}

void ProgressBar::show(const ProgressFigures& figures) {
  if (!shown_) return;
  if (form_ == ProgressForm::lines) {
    const double percent = std::floor(100 * part_done(figures));
    if (percent != std::exchange(percent_, percent)) print_note(progress_line(figures, 0, false));
    return;
  }
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
