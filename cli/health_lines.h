// What is wrong with the numbers of a job, in lines for a person.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ls::cli {

// Of the `health` of a report or of a farm's job; each cause with its first place and the command that
// replays it. Nothing: all is well, or it is not told.
std::vector<std::string> health_lines(const nlohmann::json& job);
bool unclean(const nlohmann::json& job);

// Says them, with a line above, to stderr.
void say_health(const nlohmann::json& job);

}  // namespace ls::cli
