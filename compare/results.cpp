// Makes the parts that the HTML page and the Markdown page of a comparison share.
#include "compare/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/report/log_plot.h"
#include "common/report/number_text.h"

namespace ls::race {
namespace {

using report::figure;

// The background activity of an otherwise idle system takes at most this share of all cores' time.
constexpr double kIdleShare = .05;
constexpr double kHeavySpread = 4;

std::string plural(std::size_t n, const std::string& what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

std::string name(const Race& race, std::size_t entrant) { return race.entrants[entrant].name; }

report::CurvePoint point_of(const CurveAt& at) {
  const bool band = at.relmse.lo > 0 && std::isfinite(at.relmse.hi);
  return {at.seconds, at.relmse.value, band ? at.relmse.lo : 0, band ? at.relmse.hi : 0};
}

}  // namespace

bool busy(const Machine& machine) { return machine.others > kIdleShare; }

std::string clock_words(const Conditions& conditions) {
  if (conditions.clock == RaceClock::wall)
    return fmt::format("wall seconds on {}", plural(static_cast<std::size_t>(conditions.threads), "thread"));
  return fmt::format("CPU seconds a thread, on {}",
                     plural(static_cast<std::size_t>(conditions.threads), "thread"));
}

std::string with_interval(const std::optional<Estimate>& e) {
  if (!e) return report::kAbsent;
  if (!std::isfinite(e->hi)) return figure(e->value);
  return fmt::format("{} ({} to {})", figure(e->value), figure(e->lo), figure(e->hi));
}

std::vector<std::string> paragraphs_before(const Results& results) {
  std::vector<std::string> out;
  if (results.races.empty()) return out;
  const Conditions& c = results.races.front().conditions;
  std::string limit = c.most_spp < kNoLimit ? fmt::format(" or {} samples a pixel", c.most_spp) : "";
  out.push_back(
      fmt::format("Each entrant has {} s{} ({}) for each of {}, after loading the scene; those of one seed "
                  "take turns on the same cores. {}. The machine: {}. {}.",
                  report::given(c.time), limit, clock_words(c), plural(results.seeds, "seed"),
                  results.seeds == 1 ? fmt::format("The seed is {}", results.first_seed)
                                     : fmt::format("The seeds are {} to {}", results.first_seed,
                                                   results.first_seed + (results.seeds - 1)),
                  results.machine.words, results.machine.build));
  const Machine& m = results.machine;
  if (m.others < 0)
    out.push_back("How busy the machine was with other things is not known.");
  else
    out.push_back(fmt::format(
        "{} other programs and the system had {:.1f} % of its cores' time meanwhile.",
        busy(m) ? "The machine was busy with other things, too:" : "Nothing else ran:", 100 * m.others));
  if (busy(m))
    out.push_back(
        c.clock == RaceClock::cpu
            ? "CPU seconds do not count the time that others had the cores, but caches and memory were "
              "shared with them: ratios hold better than seconds."
            : "Wall seconds on a busy machine say little: use --clock cpu, or wait until it is quiet.");
  return out;
}

std::string wide_words() {
  return fmt::format(
      "relMSE is the mean of (x - truth)² / (truth² + 0.01) at the end, efficiency 1 / (relMSE × seconds). "
      "Both are geometric means over the seeds with 95 % intervals by Student's t over their logarithms. "
      "Slope: s of relMSE ~ seconds⁻ˢ, 1 for independent samples, more where samples are spread better than "
      "by chance. The last column is how many times as efficient the first entrant is, seed by seed. 'Tail': "
      "the largest error of the seeds is more than {:g} times the smallest, so that a few pixels decide, and "
      "the geometric mean is kind.",
      kHeavySpread);
}

Table summary_table(const Results& results) {
  Table table{{"scene", "entrant", "samples", "seconds", "relMSE", "efficiency", "slope", "first over this"},
              {}};
  for (const Race& race : results.races)
    for (const Row& row : rows_of(race))
      table.rows.push_back({race.scene, name(race, row.entrant), report::sample_count(row.spp),
                            figure(row.seconds),
                            with_interval(row.relmse) + (row.spread > kHeavySpread ? " tail" : ""),
                            with_interval(row.efficiency), with_interval(row.slope),
                            row.entrant == 0 ? "" : with_interval(row.ratio)});
  return table;
}

Table forecast_table(const Results& results) {
  Table table{{"scene", "entrant", "predictions", "within their interval", "predicted over actual, median"},
              {}};
  for (const Race& race : results.races) {
    const auto all = predictions_of(race);
    for (std::size_t e = 0; e < race.entrants.size(); ++e) {
      std::vector<double> ratios;
      std::size_t count = 0, within = 0;
      for (const Prediction& p : all) {
        if (p.entrant != e) continue;
        ++count;
        within += p.within() ? 1 : 0;
        if (p.actual && *p.actual > 0) ratios.push_back(p.predicted / *p.actual);
      }
      if (count == 0) continue;
      std::sort(ratios.begin(), ratios.end());
      table.rows.push_back(
          {race.scene, name(race, e), std::to_string(count),
           fmt::format("{:.0f} %", 100. * static_cast<double>(within) / static_cast<double>(count)),
           ratios.empty() ? report::kAbsent : figure(ratios[ratios.size() / 2])});
    }
  }
  return table;
}

std::string forecast_words(const Results& results) {
  std::size_t count = 0, within = 0;
  for (const Race& race : results.races)
    for (const Prediction& p : predictions_of(race)) ++count, within += p.within() ? 1 : 0;
  if (count == 0) return "";
  return fmt::format(
      "At each doubling of their samples our renders were asked how much longer they would need to a half, a "
      "quarter and an eighth of the error they estimated then. {} of {} answers hold the actual core seconds "
      "in their 95 % interval ({:.1f} %). Counted are those whose interval ends within the race.",
      within, count, 100. * static_cast<double>(within) / static_cast<double>(count));
}

std::vector<std::string> remarks_on(const Race& race) {
  std::vector<std::string> out;
  std::string against = fmt::format("{} × {} pixels. Measured against {}.", race.conditions.size.width,
                                    race.conditions.size.height, race.reference);
  if (race.reference_noise > 0)
    against += fmt::format(" Their mean has a relMSE of {} itself, which is not counted as anybody's error.",
                           figure(race.reference_noise));
  out.push_back(std::move(against));
  std::size_t below = 0;
  for (const JudgedLane& lane : race.lanes)
    below += static_cast<std::size_t>(std::count_if(lane.points.begin(), lane.points.end(),
                                                    [](const JudgedPoint& p) { return !(p.relmse > 0); }));
  if (below > 0)
    out.push_back(fmt::format("{} cannot be measured: the reference's own noise is larger than their error.",
                              plural(below, "picture")));
  for (const Failure& f : race.failures)
    out.push_back(fmt::format("{} failed: {}", name(race, f.entrant), f.why));
  out.insert(out.end(), race.notes.begin(), race.notes.end());
  return out;
}

std::string file_name(const std::string& scene) {
  std::string out;
  for (const char c : scene)
    out += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' ? c : '_';
  return out.empty() ? "_" : out;
}

report::LogPlot plot_of(const Race& race) {
  report::LogPlot plot;
  plot.id = "race-" + file_name(race.scene);
  plot.title = race.scene + ": error against time";
  plot.summary = "relMSE over " + clock_words(race.conditions) + ", with 95 % bands over the seeds";
  plot.x_title = clock_words(race.conditions);
  plot.y_title = "relMSE";
  for (std::size_t e = 0; e < race.entrants.size(); ++e) {
    report::Curve curve{name(race, e), {}};
    for (const CurveAt& at : curve_of(race, e)) curve.points.push_back(point_of(at));
    if (!curve.points.empty()) plot.curves.push_back(std::move(curve));
  }
  return plot;
}

std::string plot_svg(const Race& race) { return report::standalone_svg(plot_of(race)); }

}  // namespace ls::race
