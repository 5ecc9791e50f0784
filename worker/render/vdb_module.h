// The interface of the OpenVDB module, a shared library that is opened only when a scene names a .vdb or
// .nvdb file (which of them it is, the file says): mapping OpenVDB costs 30 ms and 29 MB that other scenes
// need not pay. Plain C types: nothing of OpenVDB crosses it.
#pragma once

#include <cstdint>

extern "C" {

struct LsVdbGrid {
  std::int32_t size[3];       // nodes, one background node around the active voxels included
  double index_to_scene[16];  // row-major, for column vectors: node (i, j, k) -> scene
  std::int32_t channels;      // 1 or 3
  float* values;              // channels interleaved, x fastest; owned by the module, freed by ls_vdb_free
  std::uint64_t negatives;    // values below 0, made 0
};

// 0: ok. 1: the file or grid is at fault; 2: a limit. `error` receives a message of at most error_size bytes.
int ls_vdb_read(const char* path, const char* grid_name, std::uint64_t max_values, LsVdbGrid* out,
                char* error, std::uint64_t error_size);
void ls_vdb_free(LsVdbGrid* grid);
}
