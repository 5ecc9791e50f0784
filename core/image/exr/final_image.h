// The outputs of a film: the final EXR, its pixel digest, a preview and maps as PNG.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/image/error/convergence.h"
#include "core/image/exr/exr_file.h"
#include "core/image/film/film.h"

namespace ls {

// Returns the SHA-256 of the pixels. A value is float32((sumA + sumB) / (nA + nB)), with the sums and the
// numbers of samples of the two halves A and B of the samples. The division is in double, and -0 is replaced
// by +0. The order is R, G, B of each pixel, row by row, little endian. Pixels without samples are zero.
Digest pixels_sha256(const Film& film);

// Names in the image that the film does not have.
struct LayerNames {
  // Cryptomatte manifests of the two identifier layers (cryptomatte_manifest() in identifiers.h). Empty: the
  // layer gets no manifest.
  std::string shapes, materials;
  // Names of the light groups, as in RenderSettings. Groups beyond the end of the list are called by their
  // index: "0", "1", ...
  std::vector<std::string> light_groups;
};

// A fake worker (--fake, for tests) sends generated pixels instead of rendering. An image with such pixels
// has this text as the note `fake` in Provenance::notes.
inline constexpr const char* kFakePixels = "the pixels are made up by fake workers (--fake), not rendered";

// The values of those header strings `lightshaft:...` of the final EXR that do not come from the film.
// docs/design/error.md lists all header strings. These come from the film: `:relmse`, `:relmse_ci95` ("LOW
// HIGH"), `:rmse`, `:rmse_ci95`, `:few_hits` (a number of pixels), `:verdict` ("trusted", or the reason why
// not), `:pixels_without_samples` and `:tiles`. If the film has no samples, only the last two of these are
// written. `:pixels_without_samples` is written only if there are such pixels.
struct Provenance {
  Digest scene;
  std::string settings_json;  // canonical JSON of the RenderSettings
  std::string build;
  Digest numeric_class;
  // In the members below, nullopt means that the value is unknown and not written.
  std::optional<std::uint64_t> seed = {};
  std::optional<double> seconds = {};  // render time in seconds
  // "clean", or canonical_json() of the Health (numeric problems found); empty: unknown, and not written
  std::string health;
  LayerNames names = {};
  double core_seconds = 0;  // CPU seconds of all rendering; 0: unknown, and not written
  // why sampling stopped before the requested number of samples, and the consequences; empty: not written
  std::string stopped = {};
  // How far the error figures can be trusted, judged by the error over time, which the film does not contain.
  // If the verdict from the film is "trusted", but `trusted` is false in this status, `:verdict` becomes the
  // `words` of the status.
  std::optional<ConvergenceStatus> convergence_status = {};
  // further header strings that are numbers; the keys are their names without "lightshaft:"
  std::map<std::string, double> figures = {};
  // further header strings that are texts; the keys are their names without "lightshaft:"
  std::map<std::string, std::string> notes = {};
  // The standard attributes `worldToCamera` and `worldToNDC`, `framesPerSecond`, and `owner`, the name of the
  // user whose image it is (empty: not written).
  std::optional<CameraMatrices> camera = {};
  std::optional<double> frames_per_second = {};
  std::string owner = {};
  // Set for a mix of light groups: its error, instead of that of the film. The header then does not name the
  // tiles, since no tile can be verified against a mix.
  std::optional<ImageError> error_of_mix = {};
};
// The header string with the name of the image's colour space; without it, that is Rec. 709.
inline constexpr const char* kColourSpaceName = "lightshaft:color_space";

// How a film is stored as a final EXR. The colours are converted from Rec. 709 to `colour_space`: R, G, B,
// the denoised ones and the AOVs that are colours (is_colour() in aov.h); their standard errors are those of
// the converted colours, from the converted halves. Preview and pixel digest are those of Rec. 709.
struct ImageForm {
  bool float_output = false;
  ColourSpace colour_space = ColourSpace::rec709;
  ExrCompression compression = ExrCompression::zip;
  ExrParts parts = ExrParts::one;
};
struct FinalImage {
  std::vector<std::byte> exr;
  // number of values that were clamped because their magnitude exceeds 65504, the largest half
  std::uint64_t clamped = 0;
};
// Returns the layers of the final EXR with their header strings. `film` is a whole film or one row of its
// tiles. Adds the number of clamped values to `clamped` unless it is null.
ExrPicture final_layers(const Film& film, const LayerNames& names, const ImageForm& form,
                        std::uint64_t* clamped = nullptr);
// Returns the name of the layer of an AOV: the AOV's name, or for identifiers "crypto_object" or
// "crypto_material". Not for AOVs of AovKind::groups, which have a layer for each group.
std::string layer_of(Aov aov);
// Returns the name of a light group's layer: "RGB_key", or "RGB_key.volume" for volume_light_groups.
std::string layer_of_group(Aov aov, std::size_t group, std::span<const std::string> light_groups);
// The layer with this ending has half the difference between the means of the two halves of the samples,
// (A - B) / 2, of the layer without it. For a mix that multiplies each light group g by w_g, the standard
// error is the magnitude of the sum of w_g times the difference.
inline constexpr std::string_view kHalfDifference = ".delta";

// Adds the film's AOVs to `picture`: channels NAME.R, NAME.X, ...; for alpha A, and its standard error
// stderr.A (FLOAT); for light groups RGB_NAME.R, ... and RGB_NAME.delta.R, ...; for identifiers NAME00.R to
// NAME02.A with their header strings. Pixels without a surface are 0 in the AOVs of surfaces
// (AovKind::of_hits, of_all and ids). Returns the number of values that were clamped because their magnitude
// exceeded 65504, the largest half.
std::uint64_t add_aov_layers(const Film& film, const LayerNames& names, const ImageForm& form,
                             ExrPicture& picture);

// Makes the final EXR; the film may be unfinished. The layers are R, G, B (half, or float if
// form.float_output), stderr.R, stderr.G, stderr.B (FLOAT), spp (UINT), the film's AOVs, and denoised.R,
// denoised.G, denoised.B if `denoised` is not empty. `denoised` has R, G, B of each pixel of the whole
// denoised image, row by row. The header string `lightshaft:seal` has digests of all layers (seal.h), unless
// the compression is lossy.
Result<FinalImage> final_exr(const Film& film, const Provenance& provenance, const ImageForm& form,
                             std::span<const float> denoised = {});
// Writes the bytes that final_exr() returns to `sink`, one row of tiles at a time, so that a large image is
// never in memory as a whole. Returns the number of clamped values.
Result<std::uint64_t> write_final_exr(const Film& film, const Provenance& provenance, const ImageForm& form,
                                      ByteSink& sink, std::span<const float> denoised = {});

// Writes the deep image of a film, one row of tiles at a time. Fails with failed_precondition if the film has
// no slices. Compression and parts of the form do not matter. The header has the strings of the final EXR,
// and `lightshaft:deep` with the number of slices.
Result<void> write_deep_image(const Film& film, const Provenance& provenance, const ImageForm& form,
                              ByteSink& sink);
Result<std::vector<std::byte>> deep_exr_of(const Film& film, const Provenance& provenance,
                                           const ImageForm& form);
// Returns the rows of the deep image of a film, which is a whole film or one row of its tiles.
DeepRows deep_rows(const Film& film, const ImageForm& form);
inline constexpr const char* kDeepSlicesName = "lightshaft:deep";

// Returns the header strings about the error of an image; the keys are their full names. `sums` are the sums
// over all tiles of the image. `lightshaft:verdict` is based on the pixels only, not on the convergence over
// time. If there are no samples, only `lightshaft:pixels_without_samples` is returned. It is left out if
// `pixels_without_samples` is 0.
std::map<std::string, std::string> error_strings(const TileError& sums, std::uint64_t pixels_without_samples);

// Returns the number of values of R, G and B that would be clamped in an image of half floats.
std::uint64_t values_above_half(const Film& film, ColourSpace space);

// The content of a final EXR, read from an untrusted file: all layers and header strings. The layers that
// every final EXR has are required. Sizes are limited.
inline constexpr std::uint64_t kMaxFinalBytes = std::uint64_t{1} << 32;
struct FinalPicture : ExrPicture {
  bool half = false;   // true if R, G and B are stored as half floats
  bool lossy = false;  // true if a part is packed with a lossy compression
  // names of the layers and header attributes that do not match the seal ("layer depth.Z"); nullopt: there is
  // no seal
  std::optional<std::vector<std::string>> changed;
};
// Reads a final EXR. invalid_argument: something is missing or wrong; the message says what. `name` is the
// file's name for that message.
Result<FinalPicture> read_final_exr(std::span<const std::byte> exr, const std::string& name);
float as_half(float value);  // returns the value rounded to half precision

// Returns a linear pixel times `scale` in 8-bit sRGB (IEC 61966-2-1, rounded to nearest). A pixel with NaN in
// a channel is magenta.
std::array<std::uint8_t, 3> srgb8(const double* rgb, double scale);

// Encodes an image as a PNG. `pixels` has three channels of 8 bits (R, G, B), or four (R, G, B not multiplied
// by alpha, and alpha), row by row.
Result<std::vector<std::byte>> write_png(FrameSize size, std::span<const std::uint8_t> pixels);

// Turns linear colours (triples) into the codes of a display, as many as there are colours.
using ToCodes = std::function<std::vector<std::uint8_t>(std::span<const double> rgb)>;
// Each channel by srgb8().
std::vector<std::uint8_t> srgb_codes(std::span<const double> rgb);

// Returns the film as an 8-bit PNG: its means, multiplied by 2^exposure_stops, as `to_codes` shows them.
// Tiles without samples show a dark checkerboard. If the film has the AOV alpha, so does the PNG; light of
// pixels whose alpha is 0 is then lost. If `denoised` is not empty (format as for final_exr()), its pixels
// are shown instead of the film's.
Result<std::vector<std::byte>> preview_png(const Film& film, double exposure_stops,
                                           std::span<const float> denoised = {},
                                           const ToCodes& to_codes = srgb_codes);

// False-colour maps of an image's error and of its sample counts.
//
// Both use the same ramp from dark blue over green to yellow, on a logarithmic scale:
//   error: each pixel's relative standard error. Its square is the mean over channels of D^2 / (S^2 + 0.01),
//     where D is the standard error of the pixel and S its value. The square is averaged over 3 x 3 pixels of
//     the tile, because the D of a single pixel is unreliable.
//     An error of 10^-3 or less has the lowest colour, an error of 1 or more the highest.
//   samples: 2 samples per pixel have the lowest colour, 2^14 the highest.
// In the error map, pixels in which too few samples found light (has_few_hits() in error_estimate.h) are
// magenta. Tiles without samples are grey. The maps have the image's size, so that they can be overlaid on
// it.

// relative standard errors of the lowest and the highest colour
inline constexpr double kMapLeastError = 1e-3, kMapMostError = 1;
// samples per pixel of the lowest and the highest colour
inline constexpr double kMapLeastSamples = 2, kMapMostSamples = 16384;

// Maps t from 0 to 1 to a colour. Lightness increases with t, so the map can be read without distinguishing
// hues.
std::array<std::uint8_t, 3> map_colour(double t);
inline constexpr std::array<std::uint8_t, 3> kFewHitsColour = {255, 0, 255}, kNoSampleColour = {96, 96, 96};

Result<std::vector<std::byte>> error_map_png(const Film& film);
Result<std::vector<std::byte>> samples_map_png(const Film& film);

}  // namespace ls
