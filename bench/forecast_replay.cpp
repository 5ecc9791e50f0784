// What would the forecasts of today have said of races that were run before?
//   forecast_replay POINTS.CSV     of `lightshaft compare --report DIR`: DIR/points.csv
// Each scene and seed is followed as forecasts.py of the package does it: at every doubling of samples from 8
// on it is asked for a half, a quarter and an eighth of the error estimated then, and held against the first
// checkpoint that is there. Predictions whose interval ends after the race are not counted, whatever came of
// them.
#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/image/error/convergence.h"

namespace ls::test {
namespace {

using Lanes = std::vector<std::pair<std::array<std::string, 2>, std::vector<ErrorPoint>>>;  // scene, seed

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) out.push_back(cell);
  return out;
}

// Rows without an estimate (other programs') are left out.
Lanes read_lanes(std::istream& in) {
  Lanes lanes;
  std::string line;
  std::map<std::string, std::size_t> column;
  std::getline(in, line);
  for (const std::string& name : cells(line)) column.emplace(name, column.size());
  while (std::getline(in, line)) {
    const auto row = cells(line);
    const auto at = [&](const char* name) { return row.at(column.at(name)); };
    const auto number = [&](const char* name) { return std::atof(at(name).c_str()); };
    if (!(number("estimated_relmse") > 0)) continue;
    const std::array key{at("scene"), at("seed")};
    if (lanes.empty() || lanes.back().first != key) lanes.emplace_back(key, std::vector<ErrorPoint>());
    lanes.back().second.push_back({number("spp"), number("cpu_seconds"), number("estimated_relmse"),
                                   number("estimated_lo"), number("estimated_hi")});
  }
  return lanes;
}

struct Count {
  int all = 0, within = 0, late = 0;  // late: it took longer than the interval
};

// What `points` say at checkpoint `i` of a share of the error there.
void ask(const std::vector<ErrorPoint>& points, std::size_t i, double share, Count& to) {
  const double now = points[i].core_seconds, target = share * points[i].relmse;
  const auto said = forecast_of(std::span(points).first(i + 1), target);
  if (!said || said->core_seconds_hi > points.back().core_seconds - now) return;
  double took = std::numeric_limits<double>::infinity();
  for (std::size_t k = points.size(); k-- > i + 1;)
    if (points[k].relmse <= target) took = points[k].core_seconds - now;
  ++to.all;
  const bool late = took > said->core_seconds_hi * (1 + 1e-9);  // both may be the end of one round
  to.late += late;
  to.within += !late && took >= said->core_seconds_lo;
}

void table(const Lanes& lanes) {
  std::vector<std::pair<std::string, Count>> rows;
  Count sum;
  for (const auto& [key, points] : lanes) {
    if (rows.empty() || rows.back().first != key[0]) rows.emplace_back(key[0], Count());
    double wanted = 8;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      if (points[i].spp < wanted) continue;
      wanted = 2 * points[i].spp;
      for (const double share : {.5, .25, .125}) ask(points, i, share, rows.back().second);
    }
  }
  fmt::print("| scene | predictions | within | took longer |\n|---|---|---|---|\n");
  for (const auto& [scene, c] : rows) {
    fmt::print("| {} | {} | {} | {} |\n", scene, c.all, c.within, c.late);
    sum.all += c.all, sum.within += c.within;
  }
  fmt::print("\n{} of {} predictions held, {:.1f} %\n", sum.within, sum.all, 100. * sum.within / sum.all);
}

}  // namespace
}  // namespace ls::test

int main(int argc, char** argv) {
  std::ifstream in(argc == 2 ? argv[1] : "");
  if (!in) return fmt::print(stderr, "usage: {} POINTS.CSV\n", argv[0]), 2;
  ls::test::table(ls::test::read_lanes(in));
}
