// All values of a grid that was read as bricks.
#pragma once

#include <vector>

#include "worker/render/bricks/bricks.h"
#include "worker/render/media/vdb_reply.h"
#include "worker/render/vdb/nvdb.h"

namespace ls::test {

inline render::VdbGrid with_bricks(const render::VdbVoxels& voxels) {
  render::VdbGrid grid{voxels.shape, {}};
  for (int c = 0; c < voxels.shape.channels; ++c)
    grid.channels.push_back(render::make_bricks(voxels.tree, c, ~std::uint64_t{0}).value());
  return grid;
}

// The values of all nodes, x fastest; channels are interleaved.
inline std::vector<float> values_of(const render::VdbGrid& grid) {
  const auto channels = static_cast<std::size_t>(grid.shape.channels);
  std::vector<float> all;
  for (std::size_t c = 0; c < channels; ++c) {
    const std::vector<float> one =
        render::Bricks(grid.shape.size_of_box(), grid.shape.lead_of_box(), grid.channels[c]).dense();
    all.resize(channels * one.size());
    for (std::size_t i = 0; i < one.size(); ++i) all[channels * i + c] = one[i];
  }
  return all;
}

}  // namespace ls::test
