// Interface of the reader of .vdb and .nvdb files (it detects which of the two a file is), linked only into
// lightshaft-vdb (vdb_process.h). It has plain types only, so that users need no headers of OpenVDB.
#pragma once

#include <cstdint>

extern "C" {

struct LsVdbGrid {
  // Number of nodes, including one layer of background nodes around the active voxels
  std::int32_t size[3];
  double index_to_scene[16];  // maps the node (i, j, k) to the scene; row-major, for column vectors
  std::int32_t channels;      // 1 or 3 channels
  float* values;              // channels interleaved, x fastest; freed by ls_vdb_free
  std::uint64_t negatives;    // number of negative values, which were set to 0
};

// Reads the grid `grid_name` of the file `path`. Returns 0 on success, 1 if the file or the grid is at fault,
// and 2 if a limit is exceeded, such as max_values, the largest number of values. `error` receives a message
// of at most error_size bytes.
int ls_vdb_read(const char* path, const char* grid_name, std::uint64_t max_values, LsVdbGrid* out,
                char* error, std::uint64_t error_size);
void ls_vdb_free(LsVdbGrid* grid);
}
