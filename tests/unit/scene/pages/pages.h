// The generated pages of docs/reference. Each is made from the table that a reader uses.
#pragma once

#include <string>

namespace ls::scene {

std::string scene_format_markdown();
std::string mitsuba_markdown();
std::string pbrt_markdown();
std::string gltf_markdown();

namespace nori {
std::string markdown();  // the section on Nori of the page on the scene format
}

}  // namespace ls::scene
