// Files for random scenes: small images, grids and meshes, some of them with values that no one means.
#pragma once

#include <algorithm>
#include <map>
#include <string>

#include "formats/read.h"
#include "tests/property/dice.h"
#include "worker/render/render.h"

namespace ls::test {

// Where the files lie, and the reader's way to them. Files are of this process; equal bytes are one file.
class RandomAssets final : public AssetSource {
 public:
  // Keeps the bytes under a name of its own that ends in `ending`.
  Asset add(const std::string& ending, const std::string& bytes);
  Result<Asset> find(std::string_view name) override;
  Result<std::string> text(std::string_view name) override;
  const render::AssetFiles& files() const { return files_; }
  // The largest value in any of them, of images and grids.
  double largest() const { return largest_; }
  void note(double value) { largest_ = std::max(largest_, value); }

 private:
  std::map<std::string, Asset, std::less<>> named_;
  render::AssetFiles files_;
  double largest_ = 0;
};

// `wild`: how probable extreme values are, each.
Asset random_image(Dice& dice, RandomAssets& assets, double wild);  // .hdr, .exr or .bmp
// At least 2 x 3; of equal_area a square.
Asset random_environment(Dice& dice, RandomAssets& assets, double wild, SkyMapping mapping);
Asset random_obj(Dice& dice, RandomAssets& assets, double wild);
Asset random_ply(Dice& dice, RandomAssets& assets, double wild);
Asset random_serialized(Dice& dice, RandomAssets& assets, double wild);
enum class GridKind { density, share, temperature };
Asset random_vol(Dice& dice, RandomAssets& assets, double wild, GridKind kind);
Asset random_bin(Dice& dice, RandomAssets& assets, double wild, GridKind kind);

}  // namespace ls::test
