// The CSV tables.
#include <fmt/format.h>

#include <cmath>

#include "compare/results.h"

namespace ls::race {
namespace {

// Quotes a field of a table by RFC 4180.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string field(double value) { return std::isfinite(value) ? fmt::format("{:.6g}", value) : ""; }

// Returns an estimate as three fields, value and interval; they are empty for nullopt.
std::string fields(const std::optional<Estimate>& e) {
  return e ? fmt::format("{},{},{}", field(e->value), field(e->lo), field(e->hi)) : ",,";
}

std::string entrant_field(const Race& race, std::size_t entrant) {
  return field(race.entrants[entrant].name);
}

double root(double square) { return square > 0 ? std::sqrt(square) : NAN; }

}  // namespace

std::string points_csv(const Results& results) {
  std::string out =
      "scene,entrant,seed,spp,wall_seconds,cpu_seconds,seconds,relmse,rmse,estimated_relmse,estimated_lo,"
      "estimated_hi,last\n";
  for (const Race& race : results.races)
    for (const JudgedLane& lane : race.lanes)
      for (const JudgedPoint& p : lane.points) {
        const std::string estimate =
            p.estimate ? fmt::format("{},{},{}", field(p.estimate->relmse), field(p.estimate->relmse_lo),
                                     field(p.estimate->relmse_hi))
                       : ",,";
        out += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", field(race.scene),
                           entrant_field(race, lane.entrant), results.first_seed + lane.seed, field(p.spp),
                           field(p.cost.wall), field(p.cost.cpu), field(p.seconds), field(p.relmse),
                           field(root(p.mse)), estimate, p.last ? 1 : 0);
      }
  return out;
}

std::string summary_csv(const Results& results) {
  std::string out =
      "scene,entrant,seeds,spp,seconds,relmse,relmse_lo,relmse_hi,efficiency,efficiency_lo,efficiency_hi,"
      "slope,"
      "slope_lo,slope_hi,ratio,ratio_lo,ratio_hi,spread\n";
  for (const Race& race : results.races)
    for (const Row& row : rows_of(race))
      out +=
          fmt::format("{},{},{},{},{},{},{},{},{},{}\n", field(race.scene), entrant_field(race, row.entrant),
                      row.seeds, field(row.spp), field(row.seconds), fields(row.relmse),
                      fields(row.efficiency), fields(row.slope), fields(row.ratio), field(row.spread));
  return out;
}

std::string forecasts_csv(const Results& results) {
  std::string out = "scene,entrant,seed,spp,spent,target,predicted,lo,hi,actual,within\n";
  for (const Race& race : results.races)
    for (const Prediction& p : predictions_of(race))
      out += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", field(race.scene),
                         entrant_field(race, p.entrant), results.first_seed + p.seed, field(p.spp),
                         field(p.spent), field(p.target), field(p.predicted), field(p.lo), field(p.hi),
                         field(p.actual.value_or(NAN)), p.within() ? 1 : 0);
  return out;
}

}  // namespace ls::race
