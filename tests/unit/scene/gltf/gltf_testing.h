// Shared by the tests of glTF's files: builds files piece by piece, and reads them.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/unit/scene/pbrt/pbrt_testing.h"

namespace ls {

// A glTF file with a triangle in z = 0, a camera that sees it and a directional light. Tests change it.
class GltfFile {
 public:
  nlohmann::json j = nlohmann::json::parse(R"({
    "asset": {"version": "2.0"},
    "scenes": [{"nodes": [0, 1, 2]}],
    "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 5]},
              {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 3}]}},
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
    "materials": [{"name": "paint", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.5}}],
    "images": [{"uri": "wood.png"}], "textures": [{"source": 0}],
    "accessors": [], "bufferViews": [], "buffers": []})");
  std::string bytes;

  GltfFile() { add(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3"); }

  // Adds an accessor with a buffer view of its own; returns its index.
  template <class T>
  std::size_t add(const std::vector<T>& values, const std::string& type) {
    const std::size_t width = type == "SCALAR" ? 1 : static_cast<std::size_t>(type.back() - '0');
    while (bytes.size() % 4) bytes += '\0';
    const std::size_t at = bytes.size(), length = values.size() * sizeof(T);
    bytes.resize(at + length);
    std::memcpy(bytes.data() + at, values.data(), length);
    j["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", length}});
    j["accessors"].push_back({{"bufferView", j["bufferViews"].size() - 1},
                              {"componentType", code<T>()},
                              {"count", values.size() / width},
                              {"type", type}});
    return j["accessors"].size() - 1;
  }
  nlohmann::json& material() { return j["materials"][0]; }
  nlohmann::json& pbr() { return material()["pbrMetallicRoughness"]; }
  nlohmann::json& primitive() { return j["meshes"][0]["primitives"][0]; }
  nlohmann::json& attributes() { return primitive()["attributes"]; }

  std::string glb() const {
    nlohmann::json whole = j;
    if (!bytes.empty() && whole["buffers"].empty()) whole["buffers"] = {{{"byteLength", bytes.size()}}};
    std::string json = whole.dump(), chunk = bytes;
    while (json.size() % 4) json += ' ';
    while (chunk.size() % 4) chunk += '\0';
    const std::string body =
        word(json.size()) + "JSON" + json + word(chunk.size()) + std::string("BIN\0", 4) + chunk;
    return "glTF" + word(2) + word(12 + body.size()) + body;
  }
  static std::string word(std::size_t x) {
    std::string out;
    for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(x >> shift & 0xff);
    return out;
  }

 private:
  template <class T>
  static int code() {
    if constexpr (std::is_same_v<T, float>) return 5126;
    if constexpr (std::is_same_v<T, std::uint32_t>) return 5125;
    if constexpr (std::is_same_v<T, std::uint16_t>) return 5123;
    if constexpr (std::is_same_v<T, std::int16_t>) return 5122;
    if constexpr (std::is_same_v<T, std::uint8_t>) return 5121;
    return 5120;
  }
};

inline ReadResult read_gltf(std::string_view text, KeepingAssets& assets, const ReadOptions& options = {}) {
  return read_scene("test.glb", text, assets, options);
}
inline ReadResult read_gltf(const GltfFile& file, const ReadOptions& options = {}) {
  KeepingAssets assets;
  return read_gltf(file.glb(), assets, options);
}
// Reads a file that must have no errors.
inline Scene gltf(const GltfFile& file, const ReadOptions& options = {}) {
  ReadResult r = read_gltf(file, options);
  EXPECT_TRUE(r.scene) << messages(r);
  return r.scene ? *r.scene : Scene{};
}

// Reads a file that must be refused, and returns its messages.
inline std::string said_of(std::string_view text, const ReadOptions& options = {}) {
  KeepingAssets assets;
  const ReadResult r = read_gltf(text, assets, options);
  EXPECT_FALSE(r.scene);
  for (const Diagnostic& d : r.diagnostics) EXPECT_GT(d.place.line, 0);
  return messages(r);
}

}  // namespace ls
