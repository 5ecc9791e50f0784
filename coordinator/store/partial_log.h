// Accepted partials of one job: append-only files FOLDER/partials-NNN.seg. A record is a header of fixed
// size, closed by a checksum, the EXR bytes, and the unit's health as text where it isn't clean. What stood
// in a file when sync() returned survives kill -9 and power loss; a torn record behind it is found at open()
// and cut. Beside a full segment stands an index of its headers, partials-NNN.idx.
//
// append() and sync() from one thread; read() from any.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/protocol/messages.h"
#include "coordinator/store/files.h"

namespace ls::coordinator {

struct PartialRecord {
  TileIndex tile = 0;
  RoundIndex round = 0;
  SampleRange samples;
  Digest digest;  // unit digest
  WorkerId worker;
  double cpu_seconds = 0;
  double at_seconds = 0;  // since the job's first ray
  Health health;
  bool operator==(const PartialRecord&) const = default;
};

struct RawHeader;  // partial_header.h

class PartialLog {
 public:
  ~PartialLog();

  struct Place {
    std::uint32_t segment = 0;
    std::uint64_t offset = 0;  // of the EXR bytes
    std::uint32_t bytes = 0;
    std::uint64_t check = 0;  // first 8 bytes of their SHA-256
  };
  struct Entry {
    PartialRecord record;
    Place place;
  };

  // Scans the segments in order. Headers are checked everywhere, EXR bytes in the last segment, where a torn
  // tail can be; full segments were synced before the next one began. Where there is none, the folder and the
  // first one are made by the first append(): a job that waits costs no file.
  static Result<std::unique_ptr<PartialLog>> open(std::filesystem::path folder);

  const std::vector<Entry>& found() const { return found_; }  // at open()
  std::uint64_t cut_bytes() const {
    return cut_bytes_;
  }  // torn or damaged bytes that were left out at open()
  void forget_found() { std::vector<Entry>().swap(found_); }

  // After an error the file is as before.
  Result<Place> append(const PartialRecord& record, std::span<const std::byte> exr);
  // An error: nothing that was appended since the last sync is durable; it may be appended again.
  Result<void> sync();
  Result<std::vector<std::byte>> read(const Place& place) const;  // verifies the checksum

 private:
  explicit PartialLog(std::filesystem::path folder);
  std::filesystem::path segment_path(std::uint32_t segment) const;
  std::filesystem::path index_path(std::uint32_t segment) const;
  Result<void> scan(std::uint32_t segment, bool last);
  bool scan_index(std::uint32_t segment, const File& file, std::uint64_t size);
  void finish_segment();
  Result<void> start_segment(std::uint32_t segment);
  Result<void> flush();

  std::filesystem::path folder_;
  File current_;
  std::uint32_t segment_ = 0;
  std::uint64_t size_ = 0;  // of the current segment
  bool unsynced_ = false;
  std::optional<Error> lost_;       // of a full segment that could not be synced: told by the next sync()
  std::vector<RawHeader> headers_;  // of the current segment
  std::vector<Entry> found_;
  std::uint64_t cut_bytes_ = 0;
};

}  // namespace ls::coordinator
