#include "cli/scale/container_worker.h"

#include <fmt/format.h>

#include <fstream>
#include <random>

namespace ls::cli {

std::string new_worker_id() { return fmt::format("{:08x}", std::random_device{}()); }

void keep_log(const std::string& folder, const std::string& name, const std::string& text) {
  std::ofstream(fmt::format("{}/{}.log", folder, name)) << text;
}

}  // namespace ls::cli
