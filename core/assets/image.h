// Decodes images. PNG, JPEG, BMP, QOI, OpenEXR, Radiance HDR and PFM are recognised by their first bytes. TGA
// and IES files, of which not all have a signature, are recognised by the ending of the file's name, too. An
// image of more than `max_pixels` pixels is rejected with resource_exhausted, before memory is allocated for
// it. In all functions `name` is the file's name for messages.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

#include "core/assets/data.h"

namespace ls {

Result<ImageData> decode_image(std::string_view name, std::span<const std::byte> file,
                               std::uint64_t max_pixels = kMaxImagePixels);
Result<ImageData> load_image(const std::filesystem::path& path, std::string_view name,
                             std::uint64_t max_pixels = kMaxImagePixels);

// Decoders of single formats, for tests and for data whose format is known. Each comment lists the variants
// of the format that are read.
//
// PNG: 1 to 16 bits per channel, palette, alpha.
Result<ImageData> decode_png(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels = kMaxImagePixels);
// JPEG: grey or colour, 8 bits per channel.
Result<ImageData> decode_jpeg(std::string_view name, std::span<const std::byte> file,
                              std::uint64_t max_pixels = kMaxImagePixels);
// BMP: 24 and 32 bits per pixel; alpha is ignored.
Result<ImageData> decode_bmp(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels = kMaxImagePixels);
// TGA: colours of 15 to 32 bits per pixel, grey of 8 bits, colour maps; alpha if the header declares it.
Result<ImageData> decode_tga(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels = kMaxImagePixels);
// QOI: colour and alpha, 8 bits per channel, sRGB or linear.
Result<ImageData> decode_qoi(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels = kMaxImagePixels);
// OpenEXR: channels R, G, B, or X, Y, Z, or Y alone, and optionally A, of type half or float, in any
// compression and with any `chromaticities`.
Result<ImageData> decode_exr(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels = kMaxImagePixels);
// Radiance HDR: RGBE or XYZE pixels (three mantissas with one common exponent), in either run-length coding.
Result<ImageData> decode_hdr(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels = kMaxImagePixels);
// PFM: grey or colour, float32 in either byte order.
Result<ImageData> decode_pfm(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels = kMaxImagePixels);
// IES files (LM-63-1986 to 2019) of the angle types A, B and C. The result is a square image of all
// directions in the equal-area form of worker/render/math/equal_area.h: candelas, grey, 512 x 512. +z is
// straight down for a lamp under a ceiling (types A and B: where the lamp aims), and around it horizontal
// angles run from +x towards -y.
Result<ImageData> decode_ies(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels = kMaxImagePixels);

// Makes error messages of one decoder: "'NAME': broken FORMAT: PROBLEM".
struct BrokenImage {
  std::string_view name, format;
  tl::unexpected<Error> operator()(std::string_view problem) const;
};
// Returns the error with which every decoder above rejects an image of more than `max_pixels` pixels.
tl::unexpected<Error> too_many_pixels(std::string_view name, std::uint64_t width, std::uint64_t height,
                                      std::uint64_t max_pixels);

}  // namespace ls
