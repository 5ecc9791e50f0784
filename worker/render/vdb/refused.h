// How the module's readers refuse a file: caught at its door.
#pragma once

#include <cstdint>
#include <new>
#include <string>

namespace ls::render {

struct Refused {
  int code;  // what ls_vdb_read returns: 1 the file is at fault, 2 a limit
  std::string text;
};

// Room for so many values, whose number is no damaged file's: it has been held against the limit.
inline float* room_for(std::uint64_t values) {
  float* room = new (std::nothrow) float[values];
  if (!room)
    throw Refused{2, "the grid of " + std::to_string(values >> 18) +
                         " MiB needs more memory than the renderer has left of its limit"};
  return room;
}

}  // namespace ls::render
