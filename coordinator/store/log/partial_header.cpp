#include "coordinator/store/log/partial_header.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace ls::coordinator {

std::uint64_t check_of(std::span<const std::byte> bytes) {
  const Digest digest = sha256(bytes);
  std::uint64_t check = 0;
  std::memcpy(&check, digest.bytes.data(), sizeof check);
  return check;
}

std::uint64_t header_check(const RawHeader& raw) {
  return check_of(std::as_bytes(std::span(&raw, 1)).first(offsetof(RawHeader, header_check)));
}

RawHeader pack(const PartialRecord& record, std::span<const std::byte> exr,
               std::span<const std::byte> health) {
  RawHeader raw;
  raw.bytes = static_cast<std::uint32_t>(exr.size());
  raw.tile = record.tile;
  raw.round = record.round;
  raw.s0 = record.samples.s0;
  raw.s1 = record.samples.s1;
  raw.digest = record.digest.bytes;
  raw.cpu_seconds = record.cpu_seconds;
  raw.at_seconds = record.at_seconds;
  raw.health_bytes = health.size();
  if (!health.empty()) raw.health_check = check_of(health);
  std::memcpy(raw.worker.data(), record.worker.value.data(),
              std::min(record.worker.value.size(), raw.worker.size()));
  raw.payload_check = check_of(exr);
  raw.header_check = header_check(raw);
  return raw;
}

PartialRecord unpack(const RawHeader& raw, Health health) {
  PartialRecord record;
  record.tile = raw.tile;
  record.round = raw.round;
  record.samples = {raw.s0, raw.s1};
  record.digest.bytes = raw.digest;
  record.cpu_seconds = raw.cpu_seconds;
  record.at_seconds = raw.at_seconds;
  record.health = std::move(health);
  record.worker.value.assign(raw.worker.data(), strnlen(raw.worker.data(), raw.worker.size()));
  return record;
}

std::vector<std::byte> pack_index(std::span<const RawHeader> headers) {
  const auto raw = std::as_bytes(headers);
  std::vector<std::byte> out(raw.begin(), raw.end());
  const Digest digest = sha256(raw);
  const auto end = std::as_bytes(std::span(digest.bytes));
  out.insert(out.end(), end.begin(), end.end());
  return out;
}

std::optional<std::vector<RawHeader>> unpack_index(std::span<const std::byte> bytes,
                                                   std::uint64_t segment_bytes) {
  const std::size_t end = sizeof(Digest::bytes);
  if (bytes.size() < end || (bytes.size() - end) % sizeof(RawHeader) != 0) return std::nullopt;
  const auto raw = bytes.first(bytes.size() - end);
  const Digest digest = sha256(raw);
  if (std::memcmp(digest.bytes.data(), bytes.data() + raw.size(), end) != 0) return std::nullopt;
  std::vector<RawHeader> headers(raw.size() / sizeof(RawHeader));
  std::memcpy(static_cast<void*>(headers.data()), raw.data(), raw.size());
  std::uint64_t size = 0;
  for (const RawHeader& header : headers) size += header.record_bytes();
  return size == segment_bytes ? std::optional(std::move(headers)) : std::nullopt;
}

}  // namespace ls::coordinator
