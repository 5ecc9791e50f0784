// The files of a comparison: tables for programs (CSV), a page for people (HTML), the same in Markdown, and a
// plot of each scene (SVG). All functions are pure: the same results give the same text.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/report/log_plot.h"
#include "compare/forecasts.h"
#include "compare/race.h"
#include "compare/summary.h"

namespace ls::race {

struct Machine {
  std::string words;  // "AMD EPYC, 2 of 8 cores"
  // Share, 0 to 1, of all cores' time that other processes used during the races; negative: unknown
  double others = -1;
  std::string build;  // our build
};
// True if other processes used so much of the machine that wall times are unreliable.
bool busy(const Machine& machine);

struct Results {
  Machine machine;
  std::size_t seeds = 0;
  std::vector<Race> races;
  std::uint64_t first_seed = 0;  // first of `seeds` consecutive seeds
};

// Returns a table with a row per image and the columns scene, entrant, seed, spp, wall_seconds, cpu_seconds,
// seconds (on the race's clock), relmse, rmse, estimated_relmse, estimated_lo, estimated_hi, last.
std::string points_csv(const Results& results);
// Returns a table with a row per entrant and scene and the columns scene, entrant, seeds, spp, seconds,
// relmse, efficiency, slope, ratio, spread; relmse, efficiency, slope and ratio are followed by the columns
// _lo and _hi of their intervals.
std::string summary_csv(const Results& results);
// Returns a table with a row per prediction and the columns scene, entrant, seed, spp, spent, target,
// predicted, lo, hi, actual, within.
std::string forecasts_csv(const Results& results);

std::string markdown(const Results& results);
std::string html_page(const Results& results);

// Returns the contents of all these files, and of the plots, by file name.
std::map<std::string, std::string> files_of(const Results& results);

// The plot of one race, as a separate SVG file; file_name() makes the scene's name safe for a path.
std::string plot_svg(const Race& race);
std::string file_name(const std::string& scene);

// The functions below make the parts that the HTML page and the Markdown page share.

report::LogPlot plot_of(const Race& race);
std::string clock_words(const Conditions& conditions);  // "CPU seconds a thread, on 2 threads"
// Returns "0.123 (0.11 to 0.14)"; a dash for nullopt, the value alone if the interval is unbounded.
std::string with_interval(const std::optional<Estimate>& e);
std::vector<std::string> paragraphs_before(const Results& results);  // what was done, and on which machine
struct Table {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};
Table summary_table(const Results& results);
Table forecast_table(const Results& results);           // no rows: there were no predictions
std::vector<std::string> remarks_on(const Race& race);  // reference, notes, failures
std::string forecast_words(const Results& results);     // empty if there were no predictions
std::string wide_words();                               // how to read the tables

}  // namespace ls::race
