// Adapters: how another program is asked for a picture, as JSON. The whole format is described in
// docs/reference/compare.md.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/compare/racer.h"
#include "common/base/error.h"

namespace ls::race {

struct Adapter {
  std::string name;                  // in tables and plots
  std::vector<std::string> command;  // with {placeholders}
  // With {spp} in the command, it is run once per picture, each from nothing; with {time} once in all, and
  // lists the pictures that it made.
  bool lists = false;
  std::uint64_t first_spp = 4;   // of runs with {spp}
  double most_seconds = 0;       // of a run, beyond the race's time, for load and compilation
  std::set<std::string> scenes;  // by name, the only ones it can render; empty: all
  std::filesystem::path folder;  // {adapter}: where the JSON lies
};
// invalid_argument: the file cannot be read, or which key of it is wrong, and what is right.
Result<Adapter> read_adapter(const std::filesystem::path& file);
Result<Adapter> parse_adapter(const std::string& json, const std::filesystem::path& file);

// The command with its placeholders filled in; `values` has all of them.
std::vector<std::string> filled(const Adapter& adapter, const std::map<std::string, std::string>& values);

// A picture that a program says it made.
struct MadePicture {
  std::filesystem::path image;  // a name, without a folder
  double spp = 0;
  double seconds = 0;
  std::optional<double> cpu_seconds;
};
inline constexpr std::size_t kMostPictures = 64;
// The list that a program with {time} writes: one JSON object a line. invalid_argument names the line.
Result<std::vector<MadePicture>> parse_pictures(const std::string& lines);
// What a program with {spp} may write about its one picture: {"seconds": S, "cpu_seconds": C}.
Result<MadePicture> parse_times(const std::string& json);

// A program cannot have spent more than its process did. invalid_argument says what it claims.
Result<Cost> believable(const MadePicture& claim, const Cost& process, RaceClock clock);

}  // namespace ls::race
