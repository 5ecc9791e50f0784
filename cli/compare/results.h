// The files of a comparison: tables for programs (CSV), a page for people (HTML), the same in Markdown, and a
// plot of each scene (SVG). All pure: the same results give the same text.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "cli/compare/forecasts.h"
#include "cli/compare/race.h"
#include "cli/compare/summary.h"
#include "common/report/log_plot.h"

namespace ls::race {

struct Machine {
  std::string words;  // "AMD EPYC, 2 of 8 cores"
  double others =
      -1;  // share of the machine's time on all cores that others had meanwhile; negative: not known
  std::string build;  // of ours
};
// Whether others took so much of the machine that wall times say little.
bool busy(const Machine& machine);

struct Results {
  Machine machine;
  std::size_t seeds = 0;
  std::vector<Race> races;
  std::uint64_t first_seed = 0;  // those after it follow
};

// scene, entrant, seed, spp, wall_seconds, cpu_seconds, seconds (on the race's clock), relmse, rmse,
// estimated_relmse, estimated_lo, estimated_hi (ours only), last
std::string points_csv(const Results& results);
// scene, entrant, seeds, spp, seconds, relmse, _lo, _hi, efficiency, _lo, _hi, slope, _lo, _hi, ratio, _lo,
// _hi, spread
std::string summary_csv(const Results& results);
// scene, entrant, seed, spp, spent, target, predicted, lo, hi, actual, within
std::string forecasts_csv(const Results& results);

std::string markdown(const Results& results);
std::string html_page(const Results& results);

// The plot of one race, as an SVG of its own. file_name() is a name without anything that a path could mind.
std::string plot_svg(const Race& race);
std::string file_name(const std::string& scene);

// ---- shared by the two pages ----

report::LogPlot plot_of(const Race& race);
std::string clock_words(const Conditions& conditions);  // "CPU seconds a thread, on 2 threads"
// "0.123 (0.11 to 0.14)"; a dash for nothing, the value alone where the interval has no ends.
std::string with_interval(const std::optional<Estimate>& e);
std::vector<std::string> paragraphs_before(const Results& results);  // what was done, and on what
struct Table {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};
Table summary_table(const Results& results);
Table forecast_table(const Results& results);           // no rows: nothing was foretold
std::vector<std::string> remarks_on(const Race& race);  // reference, notes, failures
std::string forecast_words(const Results& results);     // "" if nothing was foretold
std::string wide_words();                               // how to read the tables

}  // namespace ls::race
