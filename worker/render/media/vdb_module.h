// Interface of the reader of .vdb and .nvdb files (the file determines which it is), linked only into
// lightshaft-vdb (vdb_process.h). It uses plain types only, so that no type of OpenVDB appears in it.
#pragma once

#include <cstdint>

extern "C" {

struct LsVdbGrid {
  std::int32_t size[3];       // nodes, including one layer of background nodes around the active voxels
  double index_to_scene[16];  // row-major, for column vectors: node (i, j, k) -> scene
  std::int32_t channels;      // 1 or 3
  float* values;              // channels interleaved, x fastest; freed by ls_vdb_free
  std::uint64_t negatives;    // values below 0, set to 0
};

// Reads the grid `grid_name` of the file `path`. Returns 0 if all is well, 1 if the file or the grid is at
// fault, and 2 if a limit is exceeded, such as max_values, the largest number of values. `error` receives a
// message of at most error_size bytes.
int ls_vdb_read(const char* path, const char* grid_name, std::uint64_t max_values, LsVdbGrid* out,
                char* error, std::uint64_t error_size);
void ls_vdb_free(LsVdbGrid* grid);
}
