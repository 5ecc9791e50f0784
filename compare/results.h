// The files with the results of a comparison: tables for programs (CSV), a page for people (HTML), the same
// page in Markdown, and a plot for each scene (SVG). All functions are pure: the same results give the same
// text. An entrant is an integrator that takes part in the comparison, which has one race per scene.
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
  std::string words;  // the processor and the cores used, such as "AMD EPYC, 2 of 8 cores"
  // Share, 0 to 1, of all cores' time that other processes used during the races; negative: unknown
  double others = -1;
  std::string build;  // the build of Lightshaft that ran the races
};
// True if other processes used so much of the machine that wall times are unreliable.
bool busy(const Machine& machine);

struct Results {
  Machine machine;
  std::size_t seeds = 0;
  std::vector<Race> races;
  std::uint64_t first_seed = 0;  // the seeds are the `seeds` consecutive numbers from this one on
};

// Returns a table with a row per image and the columns scene, entrant, seed, spp, wall_seconds, cpu_seconds,
// seconds (on the race's clock), relmse, rmse, estimated_relmse, estimated_lo, estimated_hi, last. relmse and
// rmse are measured against the reference; the render itself estimates the estimated_ columns.
std::string points_csv(const Results& results);
// Returns a table with a row per entrant and scene (Row in summary.h) and the columns scene, entrant, seeds,
// spp, seconds, relmse, efficiency, slope, ratio, spread. Each of relmse, efficiency, slope and ratio is
// followed by two columns with the ends of its interval: the name with _lo, and with _hi.
std::string summary_csv(const Results& results);
// Returns a table with a row per prediction of a remaining time (Prediction in forecasts.h) and the columns
// scene, entrant, seed, spp, spent, target, predicted, lo, hi, actual, within.
std::string forecasts_csv(const Results& results);

std::string markdown(const Results& results);
std::string html_page(const Results& results);

// Returns the contents of all files of the comparison, plots included, by file name.
std::map<std::string, std::string> files_of(const Results& results);

// Returns the plot of one race as an SVG file. file_name() turns the name of a scene into one that is safe in
// a path.
std::string plot_svg(const Race& race);
std::string file_name(const std::string& scene);

// The functions below return the parts that the HTML page and the Markdown page share.

report::LogPlot plot_of(const Race& race);
std::string clock_words(const Conditions& conditions);  // such as "CPU seconds a thread, on 2 threads"
// Returns a text such as "0.123 (0.11 to 0.14)"; only the value if the interval is unbounded; a dash for
// nullopt.
std::string with_interval(const std::optional<Estimate>& e);
std::vector<std::string> paragraphs_before(const Results& results);  // what was done, and on which machine
struct Table {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};
Table summary_table(const Results& results);
// Compares times predicted during the renders with the real ones; has no rows if no time was predicted.
Table forecast_table(const Results& results);
std::vector<std::string> remarks_on(const Race& race);  // about the reference, notes and failures
// Explains forecast_table(); empty if nothing was predicted.
std::string forecast_words(const Results& results);
std::string wide_words();  // explains the columns of summary_table()

}  // namespace ls::race
