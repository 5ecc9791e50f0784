// The interface to OpenEXR: reads external images and writes our own. Partials (files with the pixel sums of
// one tile and range of samples) have functions of their own (partial_exr.cpp). No type of the library
// appears here, and none of its exceptions escapes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/error.h"
#include "core/base/light/colour_space.h"
#include "core/image/aov/deep_planes.h"
#include "core/image/exr/deep_samples.h"
#include "core/image/frame/camera_matrices.h"
#include "core/image/frame/frame.h"

namespace ls {

struct RgbImage {
  FrameSize size;  // size of the image's data window, in pixels
  // R, G, B of each pixel, row by row from the top; values as stored (may be NaN or infinite)
  std::vector<float> rgb;
};

struct ExrLimits {
  std::uint64_t max_bytes = std::uint64_t{1} << 30;   // largest file, in bytes (default 1 GiB)
  std::uint64_t max_pixels = std::uint64_t{1} << 28;  // largest data window, in pixels (default 2^28)
  int max_side = 65536;
};

// Reads a flat scanline or tiled EXR, half or float, with any compression. It reads the file's only part, or
// the first part that has colour. The channels are R G B, or Y alone (grey); alpha is ignored. Deep files and
// files with subsampled chroma are rejected. `name` is for messages. Sizes are checked before memory is
// allocated.
Result<RgbImage> read_exr_rgb(std::span<const std::byte> bytes, const std::string& name,
                              const ExrLimits& limits = {});

// An image whose colours and alpha are wanted, such as a texture.
struct ExrImage {
  FrameSize size;              // size of the image's data window, in pixels
  std::uint32_t channels = 3;  // 3: R, G, B; 4: also A, if the file has it
  std::vector<float> values;   // row by row from the top, as stored; the channels of a pixel are adjacent
  // If the stored colours are not linear sRGB, the matrix M (row by row) by which they become that:
  // (R, G, B) of sRGB = M (R, G, B) as stored. Whites are not adapted, as in Mitsuba 3.9. M is not finite if
  // the `chromaticities` are those of no colour space: such an image serves as data only.
  std::optional<std::array<float, 9>> to_srgb = std::nullopt;
};
// As read_exr_rgb(), but with the alpha channel, and with the meaning of the colours: the header's
// `chromaticities` other than those of Rec. 709, or channels X, Y, Z (CIE 1931) in place of R, G, B.
Result<ExrImage> read_exr_image(std::span<const std::byte> bytes, const std::string& name,
                                const ExrLimits& limits = {});
// Reads a whole file. not_found: the file cannot be opened; unavailable: it cannot be read;
// resource_exhausted: it has more than limits.max_bytes bytes.
Result<std::vector<std::byte>> read_exr_bytes(const std::filesystem::path& path,
                                              const ExrLimits& limits = {});
Result<RgbImage> read_exr_rgb(const std::filesystem::path& path, const ExrLimits& limits = {});

// An image and the standard error of each of its values, from the layers stderr.R, stderr.G and stderr.B at
// full resolution. If the EXR part with the image lacks any of these layers, `error` is empty.
struct RgbWithError {
  RgbImage image;
  // standard errors of the values of image.rgb, in the same order
  std::vector<float> error;
  // values of the EXR part's header attributes of type string, by name
  std::map<std::string, std::string> strings;
};
Result<RgbWithError> read_exr_with_error(std::span<const std::byte> bytes, const std::string& name,
                                         const ExrLimits& limits = {});

inline constexpr float kLargestHalf = 65504;

// ExrPicture is an image of several planes of the same size. A plane is an ExrHalf, ExrFloat or ExrUint,
// according to the type of its values in the file. The caller must clamp the values of ExrHalf to at most
// kLargestHalf in magnitude.
struct ExrHalf {
  std::vector<float> values;
};
struct ExrFloat {
  std::vector<float> values;
};
struct ExrUint {
  std::vector<std::uint32_t> values;
};
// Standard attributes of OpenEXR that are no strings (ImfStandardAttributes.h).
struct StandardAttributes {
  std::optional<Chromaticities> chromaticities = {};
  std::optional<CameraMatrices> camera = {};     // worldToCamera and worldToNDC
  std::optional<double> frames_per_second = {};  // of the sequence to which the image belongs
};
struct ExrPicture {
  FrameSize size;
  // The planes, by the names of their channels: "R", "stderr.R", "spp", ...
  std::map<std::string, std::variant<ExrHalf, ExrFloat, ExrUint>> channels;
  std::map<std::string, std::string> strings;  // values of the header attributes of type string, by name
};
// Encodes an image as a scanline EXR with ZIP compression. The bytes depend only on the image.
Result<std::vector<std::byte>> write_exr(const ExrPicture& picture);

// How the pixels of an EXR are packed. dwaa and dwab are lossy: they change values of channels R, G, B and Y,
// also of layers ("stderr.R").
enum class ExrCompression { zip, zips, piz, rle, none, dwaa, dwab };
std::span<const ExrCompression> exr_compressions();
std::string_view to_string(ExrCompression compression);
constexpr bool is_lossy(ExrCompression c) { return c == ExrCompression::dwaa || c == ExrCompression::dwab; }
// one: all channels are in one part. layers: each layer is in a part with its name, and its channels have
// their full names ("stderr.R"). The first part is "rgba", with the channels R, G, B and A; it has all header
// strings.
enum class ExrParts { one, layers };
inline constexpr const char* kColourPart = "rgba";
std::span<const ExrParts> exr_parts();
std::string_view to_string(ExrParts parts);

// The destination of a file that is too large for memory. write() writes bytes at the offset `at` of the
// file.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  virtual Result<void> write(std::uint64_t at, std::span<const std::byte> bytes) = 0;
};
// An image that is delivered in bands of whole rows, from the top. Each band is an ExrPicture of its rows;
// all bands have the same channels. The header gets the strings below and the strings of the first band.
struct ExrBands {
  FrameSize size;
  std::map<std::string, std::string> strings;
  // Returns the band with this number, counted from 0. The bands are requested in order until they contain
  // all rows. The image is written in two passes, so each band is requested twice.
  std::function<ExrPicture(int band)> band;
  StandardAttributes standard = {};
  ExrCompression compression = ExrCompression::zip;
  ExrParts parts = ExrParts::one;
  // The parts that a lossy compression may change; the others are then packed with ZIP. Such an image must
  // have a part for each layer, and it gets no seal, because its colours are no longer those that were
  // sealed.
  std::set<std::string> lossy_parts = {};
};
// Writes the image to `sink` as one EXR file. Unless its compression is lossy, its header has a seal (digests
// of all layers and headers, seal.h).
Result<void> write_sealed_exr(const ExrBands& bands, ByteSink& sink);

// Some whole rows of a deep image: how many samples each pixel has, and the samples, pixel after pixel.
struct DeepRows {
  FrameSize size;
  std::vector<std::uint32_t> counts;
  std::vector<DeepSample> samples;
};
// A deep image that is delivered in bands, as ExrBands. Colours and alpha are halves unless `floats`.
struct DeepBands {
  FrameSize size;
  std::map<std::string, std::string> strings;
  std::function<DeepRows(int band)> band;
  StandardAttributes standard = {};
  bool colours = true;  // false: there are no channels R, G, B
  bool floats = false;
};
// Writes a file with one part of type deepscanline, with the channels A, R, G, B, Z and ZBack, packed with
// ZIPS. Its seal has each channel as a layer of the values of all samples, and the layer "samples" with the
// numbers of samples.
Result<void> write_sealed_deep_exr(const DeepBands& bands, ByteSink& sink);
struct DeepPicture {
  DeepRows rows;
  std::map<std::string, std::string> strings;
  bool colours = true, floats = false;
  std::optional<std::vector<std::string>> changed;
};
// Limits of a deep image that is read: a small file can claim very many samples.
struct DeepExpected {
  std::uint32_t slices = kMostDeepSlices;                 // a pixel has at most one sample more than slices
  std::uint64_t max_bytes = std::uint64_t{8} << 30;       // of all samples, in memory
  std::function<Result<void>(const DeepPicture&)> check;  // called with the size and headers, before pixels
};
// Reads such a file from untrusted bytes, in one band. `changed` is as in FinalPicture.
Result<DeepPicture> read_deep_exr(std::span<const std::byte> bytes, const std::string& name,
                                  const DeepExpected& expected = {});

}  // namespace ls
