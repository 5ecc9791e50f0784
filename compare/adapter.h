// Adapters: JSON files that describe how to call another program for images. The format is documented in
// docs/guide/compare.md.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "compare/racer.h"

namespace ls::race {

struct Adapter {
  std::string name;                  // in tables and plots
  std::vector<std::string> command;  // with {placeholders}
  // True for commands with {time}: the program is run once, and lists the images that it made. False for
  // commands with {spp}: it is run once per image, each time from the start.
  bool lists = false;
  std::uint64_t first_spp = 4;  // samples per pixel of the first run of a command with {spp}
  // seconds that a run may take, for loading and compilation, in addition to those that follow from the
  // race's time
  double most_seconds = 0;
  std::set<std::string> scenes;  // names of the only scenes that it can render; empty: all
  std::filesystem::path folder;  // {adapter}: the folder of the JSON file
};
// invalid_argument: the file cannot be read, or a key is wrong; the message names the key and what is
// allowed.
Result<Adapter> read_adapter(const std::filesystem::path& file);
Result<Adapter> parse_adapter(const std::string& json, const std::filesystem::path& file);

// Returns the command with its placeholders replaced; `values` must have a value for each of them.
std::vector<std::string> filled(const Adapter& adapter, const std::map<std::string, std::string>& values);

// An image that a program claims to have made.
struct MadePicture {
  std::filesystem::path image;  // a file name without a folder
  double spp = 0;
  double seconds = 0;
  std::optional<double> cpu_seconds;
};
inline constexpr std::size_t kMostPictures = 64;
// Parses the list of images written by a program with {time}: one JSON object per line. invalid_argument: a
// line is wrong; the message names it.
Result<std::vector<MadePicture>> parse_pictures(const std::string& lines);
// Parses the optional times of a program with {spp}: {"seconds": S, "cpu_seconds": C}.
Result<MadePicture> parse_times(const std::string& json);

// Returns the cost that a program claims for an image. invalid_argument: a claimed time exceeds the one that
// was measured for its process (`process`), or the CPU time is missing in a race by CPU time; the message
// names the claim.
Result<Cost> plausible_cost(const MadePicture& claim, const Cost& process, RaceClock clock);

}  // namespace ls::race
