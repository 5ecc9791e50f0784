// Classifies files by the endings of their names.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace ls::scene {

// True if the name ends in one of `endings` (for example ".gltf"), in upper or lower case.
bool has_ending(std::string_view file_name, std::initializer_list<std::string_view> endings);

// Returns why a file of this name is not read as a scene, and what to do with it; empty: it may be a scene.
std::string why_no_scene(std::string_view file_name);

}  // namespace ls::scene
