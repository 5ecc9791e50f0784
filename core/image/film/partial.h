// A partial is the result of rendering a unit: for each pixel the sums of its samples in float32, separately
// for the two halves of the samples (A: even sample indices, B: odd ones), and a header with all data that
// identify the unit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/image/aov/aov.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"

namespace ls {

// All data that determine the pixels of a unit.
struct UnitHeader {
  Digest scene;     // digest of the canonical scene
  Digest settings;  // digest of the canonical RenderSettings (core/job/settings.h)
  // Digest of the numeric class of the machine that rendered the unit.
  Digest numeric_class;
  PixelRect tile;
  SampleRange samples;
  bool operator==(const UnitHeader&) const = default;
};

// Returns the JSON text {"class":..,"s0":..,"s1":..,"scene":..,"settings":..,"tile":[x0,y0,x1,y1]}: keys
// sorted, no spaces.
std::string canonical_json(const UnitHeader& header);
Result<UnitHeader> parse_unit_header(std::string_view json);

struct Partial {
  UnitHeader header;
  // Six colour planes of tile.pixels() floats each, row by row (R, G, B of half A, then of half B), followed
  // by the planes of AOVs, which planes_of(aovs) lists. Values are sums, not means; each half has
  // header.samples.count() / 2 samples per pixel. The sums of an AOV are over both halves, except for AOVs
  // with halves (has_halves()), which have sums of each half. Every value is finite: non-finite samples are
  // counted in the health (health.h) and add zero here.
  std::vector<float> sums;
  AovSet aovs;  // the AOVs whose planes are in `sums`: those that the settings request
  bool operator==(const Partial&) const = default;
};

// Returns the SHA-256 over the header's canonical JSON followed by all planes as little-endian floats. So it
// does not depend on how an EXR file stores the planes.
Digest unit_digest(const Partial& partial);

// Encodes a partial as an EXR file with uncompressed scanlines and FLOAT channels. The dataWindow is the
// tile, the displayWindow the frame. There is one channel for each of the six colour planes and each AOV
// plane of planes_of(aovs), and no other.
Result<std::vector<std::byte>> encode_partial(const Partial& partial, FrameSize frame);

// Decodes a file made by encode_partial() for the unit `expected`, which must equal the header in the file.
// `aovs` determines the required channels. Every other file is rejected with an error that names the fault:
// other windows, channels or compression; several EXR parts; a wrong size; sums that are not finite;
// impossible identifiers or counts; data after the end of the image.
Result<Partial> decode_partial(std::span<const std::byte> exr, const UnitHeader& expected, FrameSize frame,
                               AovSet aovs = {});

// A partial and its frame size as found in a file. decode_partial_file() takes the header and the AOVs from
// the file, without expected values. `lightshaft merge` uses it.
struct PartialFile {
  Partial partial;
  FrameSize frame;
};
Result<PartialFile> decode_partial_file(std::span<const std::byte> exr);

}  // namespace ls
