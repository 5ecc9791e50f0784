// Describes the numeric health of a job in lines for a person.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ls::cli {

// Makes the lines from the `health` of `job`, which is a report or a farm's answer about a job: each cause
// with its first location and the command that renders that sample again. Empty: the job is healthy, or its
// health is unknown.
std::vector<std::string> health_lines(const nlohmann::json& job);
bool unclean(const nlohmann::json& job);

// Prints these lines to stderr, under a heading.
void print_health(const nlohmann::json& job);

}  // namespace ls::cli
