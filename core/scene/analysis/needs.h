// The features that a scene needs of the renderer, as plain data. The needs are a function of the scene
// alone. The coordinator computes them once when a job is submitted, stores them with the job and sends them
// to workers. A worker computes them again from the scene that it receives. If the two differ, coordinator
// and worker are different versions of the program, and the worker renders nothing. The needs determine the
// integrator variant (the integrator compiled for a subset of its features); `lightshaft inspect` and the
// report describe them in words.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"

namespace ls::scene {

// The text of a warning, to which a reader may add what to do.
inline constexpr std::string_view kNoLight = "the scene has no light, so that the picture is black";

struct FileNeed {
  std::string name;
  Digest digest;
  std::uint64_t bytes = 0;
  // The parts that use the file, sorted: "mesh", "texture", "environment map", "grid", "grid NAME"
  std::vector<std::string> uses;
  bool operator==(const FileNeed&) const = default;
};

struct Needs {
  // Each is true if the scene has such media. media: media of any kind; grids: media with coefficients that
  // vary in space; chromatic: media whose extinction differs between channels; emission: media that emit
  // light; anisotropic: media with a phase function that is not isotropic; phases: media with one that is
  // neither isotropic nor Henyey-Greenstein's.
  bool media = false, grids = false, chromatic = false, emission = false, anisotropic = false, phases = false;
  bool camera_in_medium = false;
  // boundaries: the scene has index-matched surfaces (bsdf "null"). null_transmission: it has other surfaces
  // through which a part of the light passes without a change of direction.
  bool boundaries = false, null_transmission = false;
  bool lens = false, crop = false;
  bool camera_motion = false;       // the camera moves while the shutter is open
  std::uint32_t moving_shapes = 0;  // number of shapes and instances that move while the shutter is open
  bool transparent_film = false;
  // Number of shapes that the camera does not see, that are held out or that catch shadows
  std::uint32_t flagged_shapes = 0;
  // Number of shapes that shadow rays or scattered rays do not meet, and of emitters whose light does not
  // reach all surfaces and media
  std::uint32_t ray_flags = 0;
  std::uint32_t linked_lights = 0;  // number of lights that are linked to receivers or blockers
  std::uint32_t meters = 0;         // number of values that are measured; 0: the scene has a camera
  // Number of objects of each type. The key is the name of the type (describe.h). Types without objects are
  // left out.
  std::map<std::string, std::uint32_t> shapes, materials, textures, lights, media_kinds;
  std::map<std::string, std::uint32_t> volumes;  // those that are computed: neither constant nor from files
  bool height = false;                           // the density of some medium falls with height (heightfog)
  std::uint32_t area_lights = 0, instances = 0;
  std::uint32_t compensated = 0;  // number of rough materials whose setting multiple_scattering is on
  // True if the density of a heterogeneous medium is in a file. The file may have three channels, which makes
  // the medium chromatic; this is known only after reading it.
  bool density_files = false;
  // True if the scene has lights, but none that a ray can hit: all are without extent, such as point, spot
  // and directional lights.
  bool only_delta_lights = false;
  // Number of lights without extent that light surfaces. Not part of canonical_json(), as it decides nothing.
  std::uint32_t delta_lights = 0;
  // The files that the scene needs, in the order of Scene::assets.
  std::vector<FileNeed> files;
  bool operator==(const Needs&) const = default;

  // Returns the number of lights that next-event estimation samples: all but a constant environment.
  std::uint32_t sampled_lights() const;
};

// Computes the needs. `scene` must be consistent and compacted (validate.h). `sees_media` is false for an
// integrator that ignores media (`path`, `whitted`).
Needs needs_of(const Scene& scene, bool sees_media);

// Returns the needs as JSON with sorted keys and without spaces, so that equal needs give equal texts. The
// member `files` is left out, because the digest of the scene covers the files. So the text has only a few
// hundred bytes, however large the scene is.
std::string canonical_json(const Needs& needs);

// Returns the first difference between two texts of canonical_json(), for a message, such as "lights.point: 2
// here, 3 there"; empty if they are equal. A text that is not JSON counts as a difference.
std::string first_difference(const std::string& here, const std::string& there);

// A part of the renderer (for example "volume grids"), whether the scene needs it, and the reason.
struct Need {
  std::string part;
  bool used = false;
  std::string why;
};
std::vector<Need> in_words(const Needs& needs);

}  // namespace ls::scene
