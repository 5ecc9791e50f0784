// The objects and extensions of glTF, and how they are translated. The reader looks up extensions in this
// table, and docs/reference/gltf.md is generated from it.
#pragma once

#include <span>
#include <string_view>

namespace ls::scene::gltf {

enum class Use { read, ignored, refused };
struct Row {
  std::string_view where, name;  // the object and its member; for an extension "" and its name
  Use use;
  std::string_view meaning;  // how it is translated; if it is not, the reason and what to do
};

std::span<const Row> objects();
std::span<const Row> extensions();
const Row* find_extension(std::string_view name);

}  // namespace ls::scene::gltf
