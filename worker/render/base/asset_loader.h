// Finds the local file of an asset (a mesh, image or volume that the scene refers to by index).
#pragma once

#include <filesystem>
#include <string>

#include "core/base/error.h"
#include "core/scene/scene.h"
#include "worker/render/render.h"

namespace ls::render {

struct AssetLoader {
  const Scene& scene;
  const AssetFiles& files;

  // Returns the local file of the scene's asset number i. Fails with Errc::internal if the caller of
  // build_world() supplied no file with that asset's digest.
  Result<std::filesystem::path> path(AssetIndex i) const {
    const Asset& asset = scene.assets.at(i.value);
    const auto it = files.find(asset.digest);
    if (it == files.end()) return fail(Errc::internal, "no file was given for '" + asset.name + "'");
    return it->second;
  }
  const std::string& name(AssetIndex i) const { return scene.assets.at(i.value).name; }
};

}  // namespace ls::render
