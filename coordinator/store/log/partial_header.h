// The binary header of a record in the partial log (partial_log.h), which holds one partial: the encoded
// pixel sums of one unit, that is of one tile and one range of samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/protocol/limits.h"
#include "coordinator/store/log/partial_log.h"

namespace ls::coordinator {

inline constexpr std::uint32_t kPartialMagic = 0x3250534c;  // "LSP2"
// "LSP1": records of an earlier version, with three counters in place of the health text
inline constexpr std::uint32_t kOldPartialMagic = 0x3150534c;

// Little endian, like every supported machine.
struct RawHeader {
  std::uint32_t magic = kPartialMagic, bytes = 0;
  std::uint32_t tile = 0, round = 0;
  std::uint64_t s0 = 0, s1 = 0;
  std::array<std::uint8_t, 32> digest{};
  double cpu_seconds = 0, at_seconds = 0;
  std::uint64_t health_bytes = 0, health_check = 0, unused = 0;
  std::array<char, ls::limits::kIdBytes> worker{};
  std::uint64_t payload_check = 0;
  std::uint64_t header_check = 0;  // over all bytes before it

  std::uint64_t text_bytes() const { return magic == kPartialMagic ? health_bytes : 0; }
  std::uint64_t record_bytes() const { return sizeof(RawHeader) + bytes + text_bytes(); }
};
static_assert(sizeof(RawHeader) == 184);

std::uint64_t check_of(std::span<const std::byte> bytes);  // the first 8 bytes of the SHA-256
std::uint64_t header_check(const RawHeader& raw);
RawHeader pack(const PartialRecord& record, std::span<const std::byte> exr,
               std::span<const std::byte> health);
PartialRecord unpack(const RawHeader& raw, Health health);

// Makes the content of a full segment's index file: the headers of all its records, one after the other, and
// their SHA-256. With it a restart need not search the 64 MiB of the segment for headers; if the index is
// lost, it does.
std::vector<std::byte> pack_index(std::span<const RawHeader> headers);
// Returns the headers in an index file; nullopt: the file is damaged, or belongs to a segment of another size
// than `segment_bytes`.
std::optional<std::vector<RawHeader>> unpack_index(std::span<const std::byte> bytes,
                                                   std::uint64_t segment_bytes);

}  // namespace ls::coordinator
