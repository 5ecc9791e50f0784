// What is handed out of a film: the final EXR, its pixel digest, and a preview PNG.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/image/aov_layers.h"
#include "common/image/convergence.h"
#include "common/image/film.h"

namespace ls {

// SHA-256 over float32((sumA+sumB)/(nA+nB)), divided in double, -0 made +0; R, G, B interleaved per pixel,
// row by row, little endian. Pixels not rendered yet are zero.
Digest pixels_sha256(const Film& film);

// Of `notes`, by the name `fake`: what to know of an image that fake workers had a hand in.
inline constexpr const char* kFakePixels = "the pixels are made up by fake workers (--fake), not rendered";

// The header strings `lightshaft:...` of the final EXR; docs/reference/image-file.md lists them. `:relmse`,
// `:relmse_ci95`
// ("LOW HIGH"), `:rmse`, `:rmse_ci95`, `:few_hits` (pixels), `:verdict` ("trusted", or why not in words) and
// `:tiles` come from the film; of one without a sample only the last. `:pixels_without_samples` stands there
// if there are any.
struct Provenance {
  Digest scene;
  std::string settings_json;  // canonical RenderSettings
  std::string build;
  Digest numeric_class;
  std::optional<std::uint64_t> seed = {};  // nothing, here and below: not known, and not written
  std::optional<double> seconds = {};      // render time
  // "clean", or canonical_json() of the Health; empty: not known, and not written.
  std::string health;
  MatteManifests manifests = {};
  double core_seconds = 0;   // CPU time of units; 0: not known, and not written
  std::string stopped = {};  // why there are no more samples, and what that means; empty: not written
  std::optional<Judgement> judgement = {};        // knows of the curve, too, what the film alone does not
  std::map<std::string, double> figures = {};     // more of them, by what follows "lightshaft:"
  std::map<std::string, std::string> notes = {};  // the same in words
};
struct FinalImage {
  std::vector<std::byte> exr;
  std::uint64_t clamped = 0;  // values whose magnitude was above 65504, the largest half
};
// The layers of the final EXR of a film, or of one row of its tiles, and the strings that come with them.
// Adds to `clamped`.
ExrPicture final_layers(const Film& film, const MatteManifests& manifests, bool float_output,
                        std::uint64_t* clamped = nullptr);
// Half R, G, B (or float), FLOAT stderr.R, stderr.G, stderr.B, UINT spp, and the film's AOVs as layers, all
// sealed in `lightshaft:seal` (exr_seal.h). Works on an unfinished film, too.
Result<FinalImage> final_exr(const Film& film, const Provenance& provenance, bool float_output);
// The same bytes into `sink`, made a row of tiles at a time: a large film's image takes no memory of its
// size. Returns how many values were clamped.
Result<std::uint64_t> write_final_exr(const Film& film, const Provenance& provenance, bool float_output,
                                      ByteSink& sink);

// The header strings that tell the error of an image whose tiles have these sums, by their whole names;
// `lightshaft:verdict` only as far as the pixels alone know it. Without a sample there are none.
std::map<std::string, std::string> error_strings(const TileError& sums, std::uint64_t pixels_without_samples);

// How many values of R, G and B it clamps in a half image.
std::uint64_t values_above_half(const Film& film);

// A final EXR of somebody's, read back: all its layers and header strings, among them at least the layers
// that every one has. Sizes are bounded.
inline constexpr std::uint64_t kMaxFinalBytes = std::uint64_t{1} << 32;
struct FinalPicture : ExrPicture {
  bool half = false;  // colours are stored as halves
  // The layers and headers that are not as its seal says, by name ("layer depth.Z"); nothing: it has no seal.
  std::optional<std::vector<std::string>> changed;
};
// invalid_argument: what is missing or wrong.
Result<FinalPicture> read_final_exr(std::span<const std::byte> exr, const std::string& name);
float as_half(float value);  // rounded to a half, as stored in one

// 8-bit sRGB (IEC 61966-2-1, rounded to nearest) of a linear pixel times `scale`; magenta if a channel is
// NaN.
std::array<std::uint8_t, 3> srgb8(const double* rgb, double scale);

// RGB, 8 bits, row by row, as a PNG.
Result<std::vector<std::byte>> write_png(FrameSize size, std::span<const std::uint8_t> rgb);

// 8-bit sRGB of the mean times 2^exposure. NaN is magenta; tiles without a sample show a quiet dark checker.
Result<std::vector<std::byte>> preview_png(const Film& film, double exposure_stops);

}  // namespace ls
