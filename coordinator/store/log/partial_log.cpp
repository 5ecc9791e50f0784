#include "coordinator/store/log/partial_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include "coordinator/base/limits.h"
#include "core/base/log.h"
#include "util/protocol/limits.h"

namespace ls::coordinator {

// Marks the start of a record of the partial log. A record holds one partial: the encoded pixel sums of one
// unit.
constexpr std::uint32_t kPartialMagic = 0x3250534c;  // the text "LSP2" in the file

// The header of a record. Its bytes in memory are written to the file unchanged, so numbers in the file are
// little endian, as on every machine that Lightshaft supports.
struct RawHeader {
  std::uint32_t magic = kPartialMagic, bytes = 0;
  std::uint32_t tile = 0, round = 0;
  std::uint64_t s0 = 0, s1 = 0;
  std::array<std::uint8_t, 32> digest{};
  double cpu_seconds = 0, at_seconds = 0;
  std::uint64_t health_bytes = 0, health_check = 0, unused = 0;
  std::array<char, ls::limits::kIdBytes> worker{};
  std::uint64_t payload_check = 0;
  std::uint64_t header_check = 0;  // checksum of the header's preceding bytes

  std::uint64_t record_bytes() const { return sizeof(RawHeader) + bytes + health_bytes; }
};
static_assert(sizeof(RawHeader) == 184);

namespace {

// Returns the first 8 bytes of the SHA-256 of `bytes`.
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

// Makes the content of the index file of a full segment: the headers of all its records, one after the other,
// and their SHA-256. A restart then reads only this file instead of searching the segment's 64 MiB for
// headers.
std::vector<std::byte> pack_index(std::span<const RawHeader> headers) {
  const auto raw = std::as_bytes(headers);
  std::vector<std::byte> out(raw.begin(), raw.end());
  const Digest digest = sha256(raw);
  const auto end = std::as_bytes(std::span(digest.bytes));
  out.insert(out.end(), end.begin(), end.end());
  return out;
}

// Returns the headers in an index file, whose content is `bytes`. nullopt: the index is damaged, or the sizes
// of the records do not add up to `segment_bytes`, the size of the segment.
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

constexpr std::uint64_t kHealthBytes = 64 << 10;

// Reads the unit's health (counts of bad samples), which is at `offset` in the file. nullopt: its text is
// damaged. Error unavailable: the file cannot be read.
Result<std::optional<Health>> health_at(const File& file, std::uint64_t offset, const RawHeader& raw,
                                        const std::filesystem::path& path) {
  if (raw.health_bytes == 0) return Health{};
  const auto bytes = read_at(file, offset, raw.health_bytes, path);
  if (!bytes) return tl::unexpected(bytes.error());
  if (check_of(*bytes) != raw.health_check) return std::nullopt;
  auto read = parse_health({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  return read ? std::optional(std::move(*read)) : std::nullopt;
}

struct Scanned {
  RawHeader raw;
  Health health;
};

// Reads the record at `offset` and verifies its checksums. nullopt: the record is damaged, or extends beyond
// the `size` bytes of the file. Error unavailable: the file cannot be read.
Result<std::optional<Scanned>> record_at(const File& file, std::uint64_t offset, std::uint64_t size,
                                         const std::filesystem::path& path) {
  if (size - offset < sizeof(RawHeader)) return std::nullopt;
  const auto bytes = read_at(file, offset, sizeof(RawHeader), path);
  if (!bytes) return tl::unexpected(bytes.error());
  RawHeader raw;
  std::memcpy(&raw, bytes->data(), sizeof raw);
  if (raw.magic != kPartialMagic || raw.header_check != header_check(raw)) return std::nullopt;
  if (raw.bytes > ls::limits::kPartialBytes || raw.health_bytes > kHealthBytes ||
      raw.bytes + raw.health_bytes > size - offset - sizeof raw)
    return std::nullopt;
  const auto exr = read_at(file, offset + sizeof raw, raw.bytes, path);
  if (!exr) return tl::unexpected(exr.error());
  if (check_of(*exr) != raw.payload_check) return std::nullopt;
  auto health = health_at(file, offset + sizeof raw + raw.bytes, raw, path);
  if (!health) return tl::unexpected(health.error());
  return *health ? std::optional(Scanned{raw, std::move(**health)}) : std::nullopt;
}

}  // namespace

PartialLog::PartialLog(std::filesystem::path folder) : folder_(std::move(folder)) {}
PartialLog::~PartialLog() = default;

std::filesystem::path PartialLog::segment_path(std::uint32_t segment) const {
  return folder_ / fmt::format("partials-{:03}.seg", segment);
}

std::filesystem::path PartialLog::index_path(std::uint32_t segment) const {
  return folder_ / fmt::format("partials-{:03}.idx", segment);
}

Result<std::unique_ptr<PartialLog>> PartialLog::open(std::filesystem::path folder) {
  // A folder that does not exist is made by the first append(). For a path that exists, make_folder() returns
  // an error unless it is a folder.
  if (std::error_code error; std::filesystem::exists(folder, error) || error)
    if (auto made = make_folder(folder); !made) return tl::unexpected(made.error());
  std::unique_ptr<PartialLog> log(new PartialLog(std::move(folder)));
  std::uint32_t count = 0;
  while (count < limits::kMaxSegments && ::access(log->segment_path(count).c_str(), F_OK) == 0) ++count;
  if (count == 0) return log;
  bool complete = true;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto scanned = log->scan(i, i + 1 == count);
    if (!scanned) return tl::unexpected(scanned.error());
    complete = *scanned;
  }
  if (!complete) log->headers_.clear();
  if (auto started = log->start_segment(complete ? count - 1 : count); !started)
    return tl::unexpected(started.error());
  return log;
}

// Reads the headers of the segment's records from its index file. False: there is no valid index.
bool PartialLog::scan_index(std::uint32_t segment, const File& file, std::uint64_t size) {
  const auto bytes = read_file(index_path(segment), limits::kMaxSegmentBytes);
  const auto headers = bytes ? unpack_index(*bytes, size) : std::nullopt;
  if (!headers) return false;
  const std::size_t before = found_.size();
  std::uint64_t at = 0;
  for (const RawHeader& raw : *headers) {
    auto health = health_at(file, at + sizeof(RawHeader) + raw.bytes, raw, segment_path(segment));
    if (!health || !*health) {
      found_.resize(before);
      return false;
    }
    found_.push_back(
        {unpack(raw, std::move(**health)), {segment, at + sizeof(RawHeader), raw.bytes, raw.payload_check}});
    at += raw.record_bytes();
  }
  return true;
}

// Reads the segment's records. Returns false if a part of the segment cannot be read now; then no new records
// may be appended to this segment.
Result<bool> PartialLog::scan(std::uint32_t segment, bool last) {
  const auto path = segment_path(segment);
  auto file = File::open(path, O_RDWR);
  if (!file) return tl::unexpected(file.error());
  struct stat info {};
  if (::fstat(file->fd(), &info) != 0) return tl::unexpected(errno_error("look at", path));
  const auto size = static_cast<std::uint64_t>(info.st_size);
  if (!last && scan_index(segment, *file, size)) return true;
  std::uint64_t at = 0;
  const auto place = [&] { return fmt::format("file={} offset={} bytes={}", path.string(), at, size - at); };
  while (at < size) {
    auto record = record_at(*file, at, size, path);
    if (!record) {
      // The file cannot be read at this place, but the records may be intact. So nothing is cut off.
      log_warn(place(),
               record.error().message + ": the units of the records from here on are rendered again");
      return false;
    }
    if (!*record) break;
    auto& [raw, health] = **record;
    found_.push_back(
        {unpack(raw, std::move(health)), {segment, at + sizeof(RawHeader), raw.bytes, raw.payload_check}});
    if (last) headers_.push_back(raw);
    at += raw.record_bytes();
  }
  if (at == size) return true;
  // The record at `at` is not intact. In the last segment the file is cut here, since this normally is a
  // record that was being written when the process ended. In an earlier segment the disk has damaged the
  // record, or writing it failed: its bytes stay in the file for examination. In both cases the units of all
  // records from here on are rendered again.
  log_warn(place(), last ? "cut a torn record" : "left out damaged records; their units are rendered again");
  if (last && ::ftruncate(file->fd(), static_cast<off_t>(at)) != 0)
    return tl::unexpected(errno_error("truncate", path));
  return true;
}

Result<void> PartialLog::start_segment(std::uint32_t segment) {
  if (segment >= limits::kMaxSegments)
    return fail(Errc::resource_exhausted, fmt::format("{} holds too many segments", folder_.string()));
  const auto path = segment_path(segment);
  auto file = File::open(path, O_RDWR | O_CREAT | O_APPEND);
  if (!file) return tl::unexpected(file.error());
  if (auto synced = sync_folder(folder_); !synced) return synced;
  struct stat info {};
  if (::fstat(file->fd(), &info) != 0) return tl::unexpected(errno_error("look at", path));
  current_ = std::move(*file);
  segment_ = segment;
  size_ = static_cast<std::uint64_t>(info.st_size);
  return {};
}

// Writes the index of the current segment, which is full. Failures are only logged: without an index a
// restart scans the whole segment. A segment that was abandoned after a failed write or sync gets no index.
void PartialLog::finish_segment() {
  std::uint64_t bytes = 0;
  for (const RawHeader& header : headers_) bytes += header.record_bytes();
  if (bytes == size_)
    if (const auto written = write_atomically(index_path(segment_), pack_index(headers_)); !written)
      log_warn(fmt::format("file={}", index_path(segment_).string()), written.error().message);
  headers_.clear();
}

Result<PartialLog::Place> PartialLog::append(const PartialRecord& record, std::span<const std::byte> exr) {
  if (exr.size() > ls::limits::kPartialBytes)
    return fail(Errc::invalid_argument, fmt::format("a partial of {} bytes is larger than {}", exr.size(),
                                                    ls::limits::kPartialBytes));
  if (!current_) {
    if (auto made = make_folder(folder_); !made) return tl::unexpected(made.error());
    if (auto done = start_segment(0); !done) return tl::unexpected(done.error());
  }
  const std::string text = record.health.clean() ? "" : canonical_json(record.health);
  const auto health = std::as_bytes(std::span(text));
  const std::uint64_t whole = sizeof(RawHeader) + exr.size() + health.size();
  if (size_ > 0 && size_ + whole > limits::kMaxSegmentBytes) {
    if (auto done = flush(); !done) {
      lost_ = done.error();
      return tl::unexpected(done.error());
    }
    finish_segment();
    if (auto done = start_segment(segment_ + 1); !done) return tl::unexpected(done.error());
  }
  const RawHeader raw = pack(record, exr, health);
  const auto path = segment_path(segment_);
  auto written = write_all(current_, std::as_bytes(std::span(&raw, 1)), path);
  if (written) written = write_all(current_, exr, path);
  if (written && !health.empty()) written = write_all(current_, health, path);
  if (!written) {
    // The next record must not follow an incomplete one. If the incomplete record cannot be cut off, the
    // segment counts as full, so that the next record opens a new one.
    if (::ftruncate(current_.fd(), static_cast<off_t>(size_)) != 0) size_ = limits::kMaxSegmentBytes;
    return tl::unexpected(written.error());
  }
  const Place place{segment_, size_ + sizeof raw, raw.bytes, raw.payload_check};
  size_ += whole;
  headers_.push_back(raw);
  unsynced_ = true;
  return place;
}

Result<void> PartialLog::sync() {
  const auto done = flush();
  if (const auto lost = std::exchange(lost_, std::nullopt)) return tl::unexpected(*lost);
  return done;
}

// Syncs the current segment. After a failed sync the operating system may have dropped data and still report
// success at the next sync. So after a failure this segment gets no more records; the next record opens
// another segment.
Result<void> PartialLog::flush() {
  if (!std::exchange(unsynced_, false)) return {};
  auto done = sync_data(current_, segment_path(segment_));
  if (!done) size_ = limits::kMaxSegmentBytes;
  return done;
}

Result<std::vector<std::byte>> PartialLog::read(const Place& place) const {
  const auto path = segment_path(place.segment);
  auto file = File::open(path, O_RDONLY);
  if (!file) return tl::unexpected(file.error());
  auto bytes = read_at(*file, place.offset, place.bytes, path);
  if (bytes && check_of(*bytes) != place.check)
    return fail(Errc::unavailable, fmt::format("{} is damaged at byte {}", path.string(), place.offset));
  return bytes;
}

}  // namespace ls::coordinator
