// Generates docs/reference/scene-format.md from the table that the reader uses.
#pragma once

#include <string>

namespace ls {

std::string scene_format_markdown();

}  // namespace ls
