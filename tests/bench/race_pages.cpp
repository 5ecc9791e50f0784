// What tests/bench/race.py has in common with `lightshaft compare`: how pictures are measured, and the pages
// and tables.
//   race_pages measure WIDTH HEIGHT REF.EXR[,REF.EXR] [PICTURE.EXR]
// prints the picture's errors against the references or, without a picture, what these are and their own
// noise.
//   race_pages write FOLDER <RACES.JSON
// writes the files of a comparison.
#include <fmt/format.h>

#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli/output/output_file.h"
#include "compare/picture.h"
#include "compare/results.h"

namespace ls::test {
namespace {

using nlohmann::json;

template <class T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

void measure(FrameSize size, const std::string& references, const char* picture) {
  std::vector<race::ReferenceFile> files;
  std::istringstream in(references);
  for (std::string file; std::getline(in, file, ',');)
    files.push_back(must(race::read_reference(file, size)));
  const race::Reference reference = race::combine(files);
  json told;
  if (picture) {
    const race::Wrong wrong = race::wrong(must(race::read_picture(picture, size)), reference);
    told = {{"mse", wrong.mse}, {"relmse", wrong.relmse}};
  } else {
    told = {{"reference", race::describe(files)}, {"noise", race::noise_of(reference)}};
  }
  std::cout << told << "\n";
}

race::JudgedLane lane_of(const json& j, const race::Conditions& conditions) {
  race::JudgedLane lane{j.at("entrant"), j.at("seed"), {}};
  for (const json& p : j.at("points")) {
    const race::Cost cost{p.at("wall"), p.at("cpu")};
    race::JudgedPoint point{p.at("spp"), cost, conditions.seconds(cost)};
    point.mse = p.at("mse"), point.relmse = p.at("relmse");
    if (p.contains("estimate")) {
      point.estimate.emplace();
      const json& e = p["estimate"];
      point.estimate->relmse = e.at(0), point.estimate->relmse_lo = e.at(1),
      point.estimate->relmse_hi = e.at(2);
    }
    lane.points.push_back(point);
  }
  lane.points.back().last = true;
  return lane;
}

race::Race race_of(const json& j, race::Conditions conditions) {
  conditions.size = {j.at("size").at(0), j.at("size").at(1)};
  race::Race race;
  race.scene = j.at("scene");
  race.conditions = conditions;
  for (const json& name : j.at("entrants")) race.entrants.push_back({name});
  for (const json& lane : j.at("lanes")) race.lanes.push_back(lane_of(lane, conditions));
  for (const json& f : j.at("failures")) race.failures.push_back({f.at("entrant"), f.at("why")});
  race.reference = j.at("reference");
  race.reference_noise = j.at("noise");
  race.notes = j.at("notes");
  return race;
}

race::Results results_of(const json& j) {
  race::Results results{
      {j.at("machine"), j.at("others"), j.at("build")}, j.at("seeds"), {}, j.at("first_seed")};
  race::Conditions conditions;
  conditions.time = j.at("time");
  conditions.clock = j.at("clock") == "cpu" ? race::RaceClock::cpu : race::RaceClock::wall;
  conditions.threads = j.at("threads");
  if (j.contains("most_spp")) conditions.most_spp = j["most_spp"];
  for (const json& race : j.at("races")) results.races.push_back(race_of(race, conditions));
  return results;
}

int run(const std::vector<std::string>& words) {
  if (words.size() >= 4 && words.size() <= 5 && words[0] == "measure")
    measure({std::stoi(words[1]), std::stoi(words[2])}, words[3],
            words.size() > 4 ? words[4].c_str() : nullptr);
  else if (words.size() == 2 && words[0] == "write")
    for (const auto& [name, text] : race::files_of(results_of(json::parse(std::cin))))
      must(cli::write_output(std::filesystem::path(words[1]) / name, text));
  else
    throw std::runtime_error(
        "usage: race_pages measure WIDTH HEIGHT REF.EXR[,REF.EXR] [PICTURE.EXR], or write FOLDER");
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace ls::test

int main(int argc, char** argv) {
  try {
    return ls::test::run({argv + 1, argv + argc});
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return EXIT_FAILURE;
  }
}
