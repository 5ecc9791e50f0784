#include "formats/file_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "core/base/safe_text.h"

namespace ls::scene {

bool has_ending(std::string_view file_name, std::initializer_list<std::string_view> endings) {
  const auto is_same = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
  };
  return std::any_of(endings.begin(), endings.end(), [&](std::string_view end) {
    return file_name.size() >= end.size() &&
           std::equal(end.rbegin(), end.rend(), file_name.rbegin(), is_same);
  });
}

std::string why_no_scene(std::string_view file_name) {
  const auto is = [&](std::initializer_list<std::string_view> endings) {
    return has_ending(file_name, endings);
  };
  if (is({".usd", ".usda", ".usdc", ".usdz"})) {
    const std::string_view stem = file_name.substr(0, file_name.rfind('.'));
    const std::string folder = std::string(stem.substr(stem.rfind('/') + 1)) + "-scene";
    return fmt::format(
        "a stage of USD is read by the Python package: python3 -m lightshaft.usd {} -o {} writes {}, which "
        "lightshaft reads (install the package by: pip install './python[usd]')",
        shell_word(std::string(file_name)), shell_word(folder), shell_word(folder + "/scene.xml"));
  }
  if (is({".blend"}))
    return "a file of Blender is rendered from within Blender, with Lightshaft's add-on, or exported there "
           "as glTF: File > Export > glTF 2.0";
  if (is({".abc", ".fbx", ".dae", ".3ds", ".max", ".ma", ".mb", ".c4d", ".hip", ".stl", ".lxo", ".lwo"}))
    return "files of this kind are not read: export the scene as glTF 2.0 (.gltf or .glb), from its program "
           "or through Blender";
  if (is({".obj", ".ply", ".serialized"})) {
    const std::string_view name = file_name.substr(file_name.rfind('/') + 1);
    return fmt::format(
        "a mesh alone has neither light nor camera: name it in a scene, by <shape type=\"{}\"><string "
        "name=\"filename\" value=\"{}\"/></shape>",
        is({".obj"})   ? "obj"
        : is({".ply"}) ? "ply"
                       : "serialized",
        name);
  }
  if (is({".vdb", ".nvdb", ".vol"}))
    return "a grid alone has neither light nor camera: name it in a scene, by a <volume type=\"gridvolume\"> "
           "in a <medium type=\"heterogeneous\">";
  if (is({".ies"}))
    return "a lamp's photometric file alone is no scene: name it in one, by <emitter "
           "type=\"goniometric\"><string "
           "name=\"filename\" value=\"...\"/></emitter>";
  if (is({".exr", ".hdr", ".pfm", ".png", ".jpg", ".jpeg", ".tif", ".tiff"}))
    return "this is an image, not a scene";
  return {};
}

}  // namespace ls::scene
