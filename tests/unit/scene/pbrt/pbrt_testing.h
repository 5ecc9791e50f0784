// Shared by the tests of pbrt's files: reads scenes that consist of given statements.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/unit/scene/scene_testing.h"

namespace ls {

inline const std::string kPbrtFilm = R"(Film "rgb" "integer xresolution" 8 "integer yresolution" 8 )";

// Returns a pbrt scene of these statements, which begin in line 3, column 1.
inline std::string pbrt_scene(std::string_view world, std::string_view before = R"(Camera "perspective")") {
  return fmt::format("{}{}\nWorldBegin\n{}\n", kPbrtFilm, before, world);
}

// Files in memory, including those that the reader makes from numbers in the scene's text.
class KeepingAssets final : public AssetSource {
 public:
  MemoryAssets memory;
  Result<Asset> find(std::string_view name) override { return memory.find(name); }
  Result<std::string> text(std::string_view name) override { return memory.text(name); }
  bool keeps() const override { return true; }
  Result<Asset> keep(std::string_view name, const std::string& bytes) override {
    memory.files[std::string(name)] = bytes;
    return memory.find(name);
  }
};

inline ReadResult read_pbrt(std::string_view text, KeepingAssets assets = {},
                            const ReadOptions& options = {}) {
  return read_scene("test.pbrt", text, assets, options);
}

// Reads these statements, which must have no errors.
inline Scene pbrt(std::string_view world, std::string_view before = R"(Camera "perspective")") {
  ReadResult r = read_pbrt(pbrt_scene(world, before));
  EXPECT_TRUE(r.scene) << messages(r);
  return r.scene ? *r.scene : Scene{};
}

inline std::string refusal(std::string_view world, std::string_view before = R"(Camera "perspective")") {
  const ReadResult r = read_pbrt(pbrt_scene(world, before));
  EXPECT_FALSE(r.scene);
  return messages(r);
}

}  // namespace ls
