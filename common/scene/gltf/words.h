// What glTF's files can say, and what becomes of it here. The reader asks this table about extensions;
// docs/reference/gltf.md is written from it.
#pragma once

#include <span>
#include <string_view>

namespace ls::scene::gltf {

enum class Use { read, ignored, refused };
struct Row {
  std::string_view where, name;  // the object and its member; of an extension its name
  Use use;
  std::string_view meaning;  // what becomes of it; if nothing does, why, and what to do
};

std::span<const Row> objects();
std::span<const Row> extensions();
const Row* find_extension(std::string_view name);

}  // namespace ls::scene::gltf
