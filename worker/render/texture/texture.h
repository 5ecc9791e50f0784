// Textures by index: constants, bitmaps, checkerboards, attributes of meshes. Lookups are Mitsuba 3's: (u, v)
// = (0, 0) is the UPPER left corner of the image (it is OBJ loading that flips v), to_uv acts first, sRGB is
// decoded before filtering. Safe for any uv, NaN included.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "common/assets/data.h"
#include "common/base/error.h"
#include "common/scene/scene.h"
#include "worker/render/math.h"
#include "worker/render/texture/surface_attributes.h"

namespace ls::render {

using ImageLoader = std::function<Result<ImageData>(const Asset&)>;

class TextureTable {
 public:
  TextureTable();
  ~TextureTable();
  TextureTable(TextureTable&&) noexcept;
  TextureTable& operator=(TextureTable&&) noexcept;

  // What the scene's meshes carry, if any of its textures reads that; both must outlive the table.
  struct MeshData {
    const SurfaceAttributes* attributes = nullptr;
    std::span<const std::uint32_t> corners;  // three vertices a triangle
  };
  // Loads each file once. invalid_argument: an index out of range, textures that refer to each other in a
  // circle or deeper than kMaxReferenceDepth, a texel that is NaN or infinite (with file and texel).
  static Result<TextureTable> build(const Scene& scene, const ImageLoader& load) {
    return build(scene, load, MeshData{});
  }
  static Result<TextureTable> build(const Scene& scene, const ImageLoader& load, MeshData meshes);

  // Without `face` attributes of meshes are black.
  C3 eval(TextureIndex i, V2 uv, const FacePoint* face = nullptr) const;
  // Where one number is wanted: the luminance, and of checkerboards the other colour (see scene.h).
  float number(TextureIndex i, V2 uv, const FacePoint* face = nullptr) const;
  // Derivatives by u and v of the luminance of a bilinear bitmap; 0 of anything else.
  V2 slope(TextureIndex i, V2 uv) const;
  double aspect(TextureIndex i) const;  // width over height of a bitmap; 1 of anything else
  bool is_constant(TextureIndex i) const;
  C3 constant(TextureIndex i) const;  // its value if is_constant(i), else its mean
  C3 mean(TextureIndex i) const;      // over the unit square, unfiltered; for sampling weights
  std::size_t size() const;
  std::uint64_t bytes() const;           // held by texels
  std::uint64_t clamped_texels() const;  // negative ones, made 0

  struct Data;
  const Data& data() const { return *data_; }  // stays where it is when the table moves

 private:
  std::unique_ptr<Data> data_;
};

}  // namespace ls::render
