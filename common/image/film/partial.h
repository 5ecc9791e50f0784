// A partial, the result of a unit (one tile and one range of samples): float32 sums of the samples of each
// pixel, separately for the two halves of the samples, with all data that identify the unit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/image/aov/aov.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"

namespace ls {

// Everything that determines a unit's pixels.
struct UnitHeader {
  Digest scene;          // digest of the canonical scene
  Digest settings;       // digest of the canonical RenderSettings (common/job/settings.h)
  Digest numeric_class;  // class of the machine that rendered it; machines of one class compute the same bits
  PixelRect tile;
  SampleRange samples;
  bool operator==(const UnitHeader&) const = default;
};

// Returns {"class":..,"s0":..,"s1":..,"scene":..,"settings":..,"tile":[x0,y0,x1,y1]}: keys sorted, no spaces.
std::string canonical_json(const UnitHeader& header);
Result<UnitHeader> parse_unit_header(std::string_view json);

struct Partial {
  UnitHeader header;
  // Six colour planes of tile.pixels() floats each, row by row, followed by those of planes_of(aovs). Values
  // are sums, not averages; the number of samples of each half follows from the range. AOVs are sums over
  // both halves, except for guides (aov.h). Every value is finite (a non-finite sample is counted and
  // contributes zero).
  std::vector<float> sums;
  AovSet aovs;  // as requested in the settings
  bool operator==(const Partial&) const = default;
};

// Returns the SHA-256 over the header's canonical JSON and all planes (little endian). It does not depend on
// the encoding in a file.
Digest unit_digest(const Partial& partial);

// Encodes a partial as an EXR file: scanline, uncompressed, FLOAT; the dataWindow is the tile, the
// displayWindow the frame. Without AOVs it has exactly the six channels; with AOVs also those of
// planes_of(aovs).
Result<std::vector<std::byte>> encode_partial(const Partial& partial, FrameSize frame);

// Decodes a file made by encode_partial() for the unit `expected`, which must equal the header in the file.
// `aovs` determines the required channels. All other files are errors, whose message names the fault: other
// windows, channels, compression, part counts or sizes, non-finite sums, impossible identifiers and counts,
// trailing data.
Result<Partial> decode_partial(std::span<const std::byte> exr, const UnitHeader& expected, FrameSize frame,
                               AovSet aovs = {});

// A partial whose header and AOVs are read from its file; for `lightshaft merge`.
struct PartialFile {
  Partial partial;
  FrameSize frame;
};
Result<PartialFile> decode_partial_file(std::span<const std::byte> exr);

}  // namespace ls
