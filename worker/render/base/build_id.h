// Identifies the rendering code: SHA-256 over its sources, compiler and flags, computed at build time
// (cmake/build_id.cmake).
#pragma once

namespace ls::render {
extern const char* const kBuildId;
}
