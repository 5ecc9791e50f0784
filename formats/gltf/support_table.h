// The objects and extensions of glTF, and how they are translated. The translation looks up extensions in
// this table, and docs/reference/gltf.md is generated from it.
#pragma once

#include <span>
#include <string_view>

namespace ls::scene::gltf {

enum class Use { read, ignored, refused };
struct Row {
  // `where`: an object of glTF; `name`: a member of it. For an extension `where` is "", and `name` is the
  // name of the extension.
  std::string_view where, name;
  Use use;
  // How the member or extension is translated; if it is not translated, why not, and what to do instead.
  std::string_view meaning;
};

std::span<const Row> objects();
std::span<const Row> extensions();
const Row* find_extension(std::string_view name);

}  // namespace ls::scene::gltf
