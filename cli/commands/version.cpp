#include <fmt/format.h>

#include "cli/commands/commands.h"
#include "worker/render/base/build_id.h"

namespace ls::cli {

std::string version_text() {
  return fmt::format("lightshaft {}, build {}", LIGHTSHAFT_VERSION, render::kBuildId);
}

}  // namespace ls::cli
