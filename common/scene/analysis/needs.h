// What a scene needs of the renderer, as plain data: a function of the scene alone, computed once when a job
// is submitted, stored with the job and sent along. A worker computes it again from the scene it receives; if
// the two differ, the program versions differ and nothing is rendered. It determines the integrator variant,
// and `lightshaft inspect` and the report describe it in words.
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
  // Media: any at all; density that varies in space; extinction that differs between channels; emission;
  // phase functions other than isotropic.
  bool media = false, grids = false, chromatic = false, emission = false, anisotropic = false;
  bool camera_in_medium = false;
  // Index-matched surfaces, and surfaces with null transmission.
  bool boundaries = false, null_transmission = false;
  bool lens = false, crop = false;
  // Number of each kind, by the names of describe.h; absent: none.
  std::map<std::string, std::uint32_t> shapes, materials, textures, lights, media_kinds;
  std::uint32_t area_lights = 0, instances = 0;
  std::uint32_t compensated = 0;  // rough materials with multiple_scattering
  // Heterogeneous media whose density is a file. They are chromatic if it has three channels, which only the
  // file tells.
  bool density_files = false;
  // All lights are points, spots, projectors or directions without extent: no ray can hit one.
  bool only_delta_lights = false;
  std::vector<FileNeed> files;  // in the scene's order
  bool operator==(const Needs&) const = default;

  // Lights that next-event estimation samples: all but a constant environment.
  std::uint32_t sampled_lights() const;
};

// `scene` must be consistent and compacted (validate.h). `sees_media`: false for the integrator `path`.
Needs needs_of(const Scene& scene, bool sees_media);

// Sorted keys, no spaces: equal needs have equal texts. Without the files, which the scene's digest covers,
// so a few hundred bytes for any scene.
std::string canonical_json(const Needs& needs);

// The first difference of two canonical texts ("lights.point: 2 here, 3 there"), for a message; empty if they
// are equal. Safe for any text.
std::string first_difference(const std::string& here, const std::string& there);

// A part of the renderer ("volume grids"), whether the scene needs it, and why or why not.
struct Need {
  std::string part;
  bool used = false;
  std::string why;
};
std::vector<Need> in_words(const Needs& needs);

}  // namespace ls::scene
