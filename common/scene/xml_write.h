// Scene -> canonical Mitsuba 3 XML, out of the same table that reads it (describe.h).
#pragma once

#include <string>

#include "common/scene/scene.h"

namespace ls {

// Reading the text gives a scene equal to this one, if the files that it names are found by their names in
// scene.assets: same digest. Every value is written, numbers in the shortest form that reads back to the same
// bits, transforms as matrices (none for the identity). Bsdfs, volumes, phase functions, media and textures
// stand at the top and are referred to by ids: their kind and place in the scene's own lists, so that equal
// scenes give equal text. Colours that one object alone has stand in it. `scene` is one that was read, or is
// consistent and compacted (validate.h).
std::string write_xml(const Scene& scene);

}  // namespace ls
