// What is believed of a reply of lightshaft-vdb (vdb_reply.h): a file made to harm may have written it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/error.h"
#include "worker/render/vdb_module.h"

namespace ls::render {

// The grid of a reply, whose values stay where they are in `reply`: no more than max_values, finite and not
// negative; sizes of 1 at least, a finite transform. invalid_argument: the file is at fault, or the reply is
// none; resource_exhausted: a limit. `reply` begins where a page does, as mapped memory.
Result<LsVdbGrid> believed_grid(std::span<const std::byte> reply, std::uint64_t max_values);

// The error of a reply that is none.
tl::unexpected<Error> vdb_nonsense();

}  // namespace ls::render
