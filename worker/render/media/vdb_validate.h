// Validates a reply of lightshaft-vdb (vdb_reply.h), whose content a malicious file may have determined.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/error.h"
#include "worker/render/media/vdb_module.h"

namespace ls::render {

// Checks the grid of a reply and returns it. A valid grid has at most max_values values, all finite and not
// negative, sizes of at least 1 and a finite transform. Its values stay where they are in `reply`, which must
// be page-aligned, as mapped memory is. Fails with invalid_argument if the file is at fault or the reply is
// malformed, and with resource_exhausted if a limit is exceeded.
Result<LsVdbGrid> validated_grid(std::span<const std::byte> reply, std::uint64_t max_values);

// The error that the caller reports for a malformed reply.
tl::unexpected<Error> vdb_nonsense();

}  // namespace ls::render
