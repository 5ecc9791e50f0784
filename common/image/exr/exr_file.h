// The interface to OpenEXR: reads external images and writes our own. Partials have their own functions
// (partial_exr.cpp). No type of the library appears here, and none of its exceptions escapes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/error.h"
#include "common/image/frame/frame.h"

namespace ls {

struct RgbImage {
  FrameSize size;  // size of the data window
  // R, G, B of each pixel, row by row from the top; values as stored (may be NaN or infinite)
  std::vector<float> rgb;
};

struct ExrLimits {
  std::uint64_t max_bytes = std::uint64_t{1} << 30;   // largest file, in bytes
  std::uint64_t max_pixels = std::uint64_t{1} << 28;  // largest data window, in pixels
  int max_side = 65536;
};

// Reads a flat scanline or tiled EXR, half or float, with any compression. It reads the file's only part, or
// the first part that has colour. The channels are R G B, or Y alone (grey); alpha is ignored. Deep files and
// files with subsampled chroma are rejected. `name` is for messages. Sizes are checked before memory is
// allocated.
Result<RgbImage> read_exr_rgb(std::span<const std::byte> bytes, const std::string& name,
                              const ExrLimits& limits = {});
// Reads a whole file. Errors: not_found, unavailable; resource_exhausted if the file has more than
// limits.max_bytes.
Result<std::vector<std::byte>> read_exr_bytes(const std::filesystem::path& path,
                                              const ExrLimits& limits = {});
Result<RgbImage> read_exr_rgb(const std::filesystem::path& path, const ExrLimits& limits = {});

// An image with the standard error of each value, if the part has layers stderr.R, stderr.G and stderr.B at
// full resolution; otherwise `error` is empty.
struct RgbWithError {
  RgbImage image;
  std::vector<float> error;                    // in the order of image.rgb
  std::map<std::string, std::string> strings;  // header strings
};
Result<RgbWithError> read_exr_with_error(std::span<const std::byte> bytes, const std::string& name,
                                         const ExrLimits& limits = {});

inline constexpr float kLargestHalf = 65504;

// An image of several planes of the same size. The type of a plane is the type of its values in the file. The
// caller must clamp the values of ExrHalf to at most kLargestHalf in magnitude.
struct ExrHalf {
  std::vector<float> values;
};
struct ExrFloat {
  std::vector<float> values;
};
struct ExrUint {
  std::vector<std::uint32_t> values;
};
struct ExrPicture {
  FrameSize size;
  // The planes, by the names of their channels: "R", "stderr.R", "spp", ...
  std::map<std::string, std::variant<ExrHalf, ExrFloat, ExrUint>> channels;
  std::map<std::string, std::string> strings;  // header attributes
};
// Encodes an image as a scanline EXR with ZIP compression. The bytes depend only on the image.
Result<std::vector<std::byte>> write_exr(const ExrPicture& picture);

// Destination for files that are too large for memory.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  virtual Result<void> write(std::uint64_t at, std::span<const std::byte> bytes) = 0;
};
// An image that is delivered in bands of whole rows, from the top. Each band is an ExrPicture of its rows;
// all bands have the same channels. The strings of the first band are added to the header.
struct ExrBands {
  FrameSize size;
  std::map<std::string, std::string> strings;
  // Returns the next band, until all rows are delivered. The image is written in two passes, so this is
  // called twice for each of the bands 0, 1, 2, ...
  std::function<ExrPicture(int band)> band;
};
// Writes the image to `sink` as one EXR file with a seal (digests of all layers and headers, seal.h) in its
// header.
Result<void> write_sealed_exr(const ExrBands& bands, ByteSink& sink);

}  // namespace ls
