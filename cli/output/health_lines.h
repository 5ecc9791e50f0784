// Describes the numeric health of a job in lines for a person.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ls::cli {

// From the `health` of a report or of a farm's job: each cause with its first location and the command that
// replays it. Empty: healthy, or unknown.
std::vector<std::string> health_lines(const nlohmann::json& job);
bool unclean(const nlohmann::json& job);

// Prints them to stderr, under a heading.
void print_health(const nlohmann::json& job);

}  // namespace ls::cli
