// What a scene needs of the renderer, as plain data: a function of the scene alone, computed once where a job
// is taken in, stored with the job and sent along. A worker computes it again from the scene it got; if the
// two differ they are of different versions, and no pixel is rendered. It chooses the integrator's
// instantiation, and `lightshaft inspect` and the report put it into words.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

struct FileNeed {
  std::string name;
  Digest digest;
  std::uint64_t bytes = 0;
  std::vector<std::string> uses;  // sorted: "mesh", "texture", "environment map", "grid", "grid NAME"
  bool operator==(const FileNeed&) const = default;
};

struct Needs {
  // Of participating media: any at all; densities that vary in space; extinction that differs between
  // channels; light given off; phase functions other than the isotropic one.
  bool media = false, grids = false, chromatic = false, emission = false, anisotropic = false;
  bool camera_in_medium = false;
  // Surfaces that light passes unchanged, and those that a share of it passes.
  bool boundaries = false, veils = false;
  bool lens = false, crop = false;
  // How many of each, by the names of describe.h; absent: none.
  std::map<std::string, std::uint32_t> shapes, materials, textures, lights, media_kinds;
  std::uint32_t area_lights = 0, instances = 0;
  std::uint32_t compensated = 0;  // rough materials with multiple_scattering
  // Heterogeneous media whose density is a file: of three channels, as only the file says, they are
  // chromatic.
  bool density_files = false;
  // Points, spots, projectors and directions without an extent alone: no ray can hit one.
  bool only_delta_lights = false;
  std::vector<FileNeed> files;  // in the scene's order
  bool operator==(const Needs&) const = default;

  // Lights that next-event estimation chooses from: all but a constant surrounding.
  std::uint32_t sampled_lights() const;
};

// `scene` is consistent and compacted (validate.h). `sees_media`: false for the integrator `path`.
Needs needs_of(const Scene& scene, bool sees_media);

// Sorted keys, no spaces: equal needs have equal texts. Without the files, which the scene's digest covers: a
// few hundred bytes whatever the scene.
std::string canonical_json(const Needs& needs);

// The first part in which two canonical texts differ ("lights.point: 2 here, 3 there"), for a message; empty
// if they are equal. Safe on any text.
std::string first_difference(const std::string& here, const std::string& there);

// A part of the renderer and whether the scene needs it: "volume grids", with what makes it so or why not.
struct Need {
  std::string part;
  bool used = false;
  std::string why;
};
std::vector<Need> in_words(const Needs& needs);

}  // namespace ls::scene
