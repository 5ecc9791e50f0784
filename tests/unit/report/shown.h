// The table of figures and ticks as people read them, which reports and the dashboard are both held to.
#pragma once

#include <fstream>
#include <nlohmann/json.hpp>

namespace ls::report {

inline nlohmann::json shown(const char* what) {
  return nlohmann::json::parse(std::ifstream(LS_SOURCE_DIR "/tests/support/shown.json")).at(what);
}

}  // namespace ls::report
