// The canonical form of a Scene: JSON with sorted keys, all fields (except fields marked Field::elided that
// have their default), doubles in the shortest form that reads back to the same bits. Its SHA-256 is the
// scene's digest. The coordinator sends this form to workers.
#pragma once

#include <string>
#include <string_view>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/scene/scene.h"

namespace ls {

std::string serialize(const Scene& scene);
// Parses the canonical form. The input is untrusted: sizes, indices and ranges are checked.
Result<Scene> deserialize_scene(std::string_view json);
Digest digest_of(const Scene& scene);

namespace scene {

// Returns the shortest text that reads back to the same bits. x must be finite; -0 is written as 0, so that
// equal numbers have equal texts.
std::string shortest_number(double x);

}  // namespace scene
}  // namespace ls
