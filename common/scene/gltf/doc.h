// Generates docs/reference/gltf.md from the reader's table.
#pragma once

#include <string>

namespace ls {

std::string gltf_markdown();

}  // namespace ls
