// Reads the table of numbers and ticks with their texts (tests/support/shown.json). Reports and the dashboard
// must both show these texts.
#pragma once

#include <fstream>
#include <nlohmann/json.hpp>

namespace ls::report {

inline nlohmann::json shown(const char* what) {
  return nlohmann::json::parse(std::ifstream(LS_SOURCE_DIR "/tests/support/shown.json")).at(what);
}

}  // namespace ls::report
