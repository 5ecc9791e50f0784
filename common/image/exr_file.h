// The one door to OpenEXR: reading a picture of someone else's, writing our own. Partials have theirs beside
// it (exr_partial.h). Nothing of the library shows here, and no exception of it leaves.
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
#include "common/image/frame.h"

namespace ls {

struct RgbImage {
  FrameSize size;          // of the data window
  std::vector<float> rgb;  // interleaved, row by row from the top; values as stored (may be NaN or infinite)
};

struct ExrLimits {
  std::uint64_t max_bytes = std::uint64_t{1} << 30;   // of the file
  std::uint64_t max_pixels = std::uint64_t{1} << 28;  // of the data window
  int max_side = 65536;
};

// Flat scanline or tiled EXR, half/float, any compression, with losses or without; single part, or the first
// part that has colour. Channels R G B, or Y alone (grey); alpha is left out. Chroma-subsampled
// (luminance/chroma) and deep files are refused. `name` is for the messages. Sizes are checked before
// anything is allocated.
Result<RgbImage> read_exr_rgb(std::span<const std::byte> bytes, const std::string& name,
                              const ExrLimits& limits = {});
// A file whole: not_found, unavailable; resource_exhausted: more than limits.max_bytes.
Result<std::vector<std::byte>> read_exr_bytes(const std::filesystem::path& path,
                                              const ExrLimits& limits = {});
Result<RgbImage> read_exr_rgb(const std::filesystem::path& path, const ExrLimits& limits = {});

// The same with the standard error of each value, where the part has layers stderr.R, stderr.G and stderr.B
// at full resolution; `error` is empty where it has not.
struct RgbWithError {
  RgbImage image;
  std::vector<float> error;                    // interleaved as image.rgb
  std::map<std::string, std::string> strings;  // of its header
};
Result<RgbWithError> read_exr_with_error(std::span<const std::byte> bytes, const std::string& name,
                                         const ExrLimits& limits = {});

inline constexpr float kLargestHalf = 65504;

// A picture of several planes of one size.
struct ExrHalf {
  std::vector<float> values;
};  // converted; the caller has clamped to +-kLargestHalf
struct ExrFloat {
  std::vector<float> values;
};
struct ExrUint {
  std::vector<std::uint32_t> values;
};
struct ExrPicture {
  FrameSize size;
  std::map<std::string, std::variant<ExrHalf, ExrFloat, ExrUint>> channels;  // "R", "stderr.R", "spp", ...
  std::map<std::string, std::string> strings;                                // header attributes
};
// Scanline, ZIP compressed. The bytes are a function of the picture only.
Result<std::vector<std::byte>> write_exr(const ExrPicture& picture);

// Where the bytes of a file go that is larger than one likes to have in memory.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  virtual Result<void> write(std::uint64_t at, std::span<const std::byte> bytes) = 0;
};
// A picture that comes in bands of whole rows, from the top: each of them as a picture of as many rows, all
// with the same channels. The strings of the first one go into the header, too.
struct ExrBands {
  FrameSize size;
  std::map<std::string, std::string> strings;
  std::function<ExrPicture(int band)> band;  // asked for 0, 1, 2, ... until there are all rows; twice
};
// The file is that of the whole picture, with the seal of all of it in its header (exr_seal.h).
Result<void> write_sealed_exr(const ExrBands& bands, ByteSink& sink);

}  // namespace ls
