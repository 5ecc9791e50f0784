// How long an EXR attribute's value is by its type. The library reads most types by what is in them and not
// by the size that the header states; where both disagree it reads on in the middle of something else, and
// takes any four bytes there for the size of a buffer that it allocates.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace ls::exr {

// Whether the library reads a value of this type from exactly these bytes. Of types that it doesn't know it
// does: it keeps their bytes.
bool fills_its_size(std::string_view type, std::span<const std::byte> value);

}  // namespace ls::exr
