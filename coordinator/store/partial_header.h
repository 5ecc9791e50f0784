// The head of a record of the partial log, as it stands on the disk.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/protocol/limits.h"
#include "coordinator/store/partial_log.h"

namespace ls::coordinator {

inline constexpr std::uint32_t kPartialMagic = 0x3250534c;  // "LSP2"
inline constexpr std::uint32_t kOldPartialMagic =
    0x3150534c;  // "LSP1": with three counters instead of a text

// Little endian like every machine we run on.
struct RawHeader {
  std::uint32_t magic = kPartialMagic, bytes = 0;
  std::uint32_t tile = 0, round = 0;
  std::uint64_t s0 = 0, s1 = 0;
  std::array<std::uint8_t, 32> digest{};
  double cpu_seconds = 0, at_seconds = 0;
  std::uint64_t health_bytes = 0, health_check = 0, unused = 0;
  std::array<char, ls::limits::kIdBytes> worker{};
  std::uint64_t payload_check = 0;
  std::uint64_t header_check = 0;  // over all before it

  std::uint64_t text_bytes() const { return magic == kPartialMagic ? health_bytes : 0; }
  std::uint64_t record_bytes() const { return sizeof(RawHeader) + bytes + text_bytes(); }
};
static_assert(sizeof(RawHeader) == 184);

std::uint64_t check_of(std::span<const std::byte> bytes);  // the first 8 bytes of their SHA-256
std::uint64_t header_check(const RawHeader& raw);
RawHeader pack(const PartialRecord& record, std::span<const std::byte> exr,
               std::span<const std::byte> health);
PartialRecord unpack(const RawHeader& raw, Health health);

// The heads of a full segment, one after the other and closed by a SHA-256, so that a restart need not look
// for them in 64 MiB. The file can be lost: then it does.
std::vector<std::byte> pack_index(std::span<const RawHeader> headers);
// Nothing: damaged, or not of a segment of so many bytes.
std::optional<std::vector<RawHeader>> unpack_index(std::span<const std::byte> bytes,
                                                   std::uint64_t segment_bytes);

}  // namespace ls::coordinator
