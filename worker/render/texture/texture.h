// Textures by index: constants, bitmaps, checkerboards, mesh attributes, and functions of other textures.
// Lookups follow Mitsuba 3: (u, v) = (0, 0) is the UPPER left corner of the image (OBJ loading flips v),
// to_uv is applied first, sRGB is decoded before filtering. Safe for any uv, including NaN.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "core/assets/data.h"
#include "core/base/error.h"
#include "core/scene/scene.h"
#include "worker/render/math/math.h"
#include "worker/render/texture/surface_attributes.h"

namespace ls::render {

using ImageLoader = std::function<Result<ImageData>(const Asset&)>;

class TextureTable {
 public:
  TextureTable();
  ~TextureTable();
  TextureTable(TextureTable&&) noexcept;
  TextureTable& operator=(TextureTable&&) noexcept;

  // The mesh attributes. build() needs them if any texture of the scene reads mesh attributes. The data that
  // the two members refer to must outlive the table.
  struct MeshData {
    const SurfaceAttributes* attributes = nullptr;
    std::span<const std::uint32_t> corners;  // three vertex indices per triangle
  };
  // Builds the table of the scene's textures; `load` is called once for each image file that textures read.
  // Fails with invalid_argument if an index is out of range, if textures refer to each other in a cycle or
  // deeper than kMaxReferenceDepth, or if a texel is NaN or infinite (the message names the file and the
  // texel).
  static Result<TextureTable> build(const Scene& scene, const ImageLoader& load) {
    return build(scene, load, MeshData{});
  }
  static Result<TextureTable> build(const Scene& scene, const ImageLoader& load, MeshData meshes);

  // Returns the value of texture i at uv. `face` is the point on a triangle at which mesh attributes are
  // read; if it is null, mesh attributes are black.
  C3 eval(TextureIndex i, V2 uv, const FacePoint* face = nullptr) const;
  // Returns the value of texture i at uv as a scalar: its luminance. In a checkerboard read as a scalar the
  // two colours are swapped, as in Mitsuba (see CheckerboardTexture in scene.h).
  float number(TextureIndex i, V2 uv, const FacePoint* face = nullptr) const;
  // Returns the derivatives by u and v of the luminance of texture i at uv if it is a bilinear bitmap; 0 for
  // other textures.
  V2 slope(TextureIndex i, V2 uv) const;
  double aspect(TextureIndex i) const;  // width over height of a bitmap; 1 for other textures
  bool is_constant(TextureIndex i) const;
  C3 constant(TextureIndex i) const;  // the texture's value if is_constant(i), else its mean
  C3 mean(TextureIndex i) const;      // mean over the unit square, unfiltered; used for sampling weights
  std::size_t size() const;
  std::uint64_t bytes() const;           // memory of all texels, in bytes
  std::uint64_t clamped_texels() const;  // number of negative texels that were set to 0

  struct Data;
  const Data& data() const { return *data_; }  // the reference stays valid when the table is moved

 private:
  std::unique_ptr<Data> data_;
};

}  // namespace ls::render
