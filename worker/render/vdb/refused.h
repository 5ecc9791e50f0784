// The exception that the readers of .vdb and .nvdb files throw to reject a file; ls_vdb_read catches it.
#pragma once

#include <cstdint>
#include <new>
#include <string>

namespace ls::render {

struct Refused {
  int code;  // the return value of ls_vdb_read: 1 if the file is at fault, 2 if a limit is exceeded
  std::string text;
};

// Allocates an array of `values` values; the caller has already checked that number against the limit.
inline float* room_for(std::uint64_t values) {
  float* room = new (std::nothrow) float[values];
  if (!room)
    throw Refused{2, "the grid of " + std::to_string(values >> 18) +
                         " MiB needs more memory than the renderer has left of its limit"};
  return room;
}

}  // namespace ls::render
