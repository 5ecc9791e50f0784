// Writes the page docs/reference/pbrt.md from the reader's table.
#pragma once

#include <string>

namespace ls {

std::string pbrt_markdown();

}  // namespace ls
