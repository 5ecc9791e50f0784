// Writes a Scene as canonical Mitsuba 3 XML, by the same table by which scenes are read (describe.h).
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace ls {

// Returns the XML text. Reading this text gives an equal scene with the same digest, provided that the reader
// finds the scene's files under their names in scene.assets. Every value is written: numbers in the shortest
// form that reads back to the same bits, transforms as matrices (none for the identity). Bsdfs, volumes,
// phase functions, media and textures are at the top level and referred to by ids made of their kind and
// index, so that equal scenes give equal text. Colours that only one object uses are nested in that object.
// `scene` must come from the reader, or be consistent and compacted (validate.h).
std::string write_xml(const Scene& scene);

// The text, and what of it Mitsuba 3.9 does not read: plugins ("bsdf \"coatedconductor\""), parameters
// ("'tint' of medium \"heterogeneous\"") and kinds of files, each once.
struct WrittenScene {
  std::string text;
  std::vector<std::string> only_ours;
};
WrittenScene write_scene(const Scene& scene);

}  // namespace ls
