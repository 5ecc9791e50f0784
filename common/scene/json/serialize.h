// The canonical form of a Scene: JSON with sorted keys, all fields (except some that have their default,
// Field::elided), doubles in the shortest form that reads back to the same bits. Its SHA-256 is the scene's
// digest. The coordinator sends this form to workers.
#pragma once

#include <string>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/scene/scene.h"

namespace ls {

std::string serialize(const Scene& scene);
Result<Scene> deserialize_scene(
    std::string_view json);  // untrusted input: sizes, indices and ranges are checked
Digest digest_of(const Scene& scene);

}  // namespace ls
