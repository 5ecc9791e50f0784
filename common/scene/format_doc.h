// docs/reference/scene-format.md, out of the table that reads scenes.
#pragma once

#include <string>

namespace ls {

std::string scene_format_markdown();

}  // namespace ls
