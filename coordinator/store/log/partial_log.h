// The accepted partials of one job, in append-only files FOLDER/partials-NNN.seg, called segments. A partial
// is the pixel sums, encoded as EXR, of one unit. Each partial has a record: a header of fixed size with a
// checksum, the EXR bytes and, if the unit had bad samples, its health (counts of bad samples) as text.
// Records written before sync() returned survive kill -9 and power loss; a torn record behind them is
// detected at open() and cut off. Beside each full segment lies an index of its headers, partials-NNN.idx.
//
// One thread may call append() and sync(); any thread may call read().
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "coordinator/store/files.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "util/protocol/messages.h"

namespace ls::coordinator {

struct PartialRecord {
  TileIndex tile = 0;
  RoundIndex round = 0;
  SampleRange samples;
  Digest digest;  // digest of the unit's pixels
  WorkerId worker;
  double cpu_seconds = 0;
  double at_seconds = 0;  // time of storing, in seconds since the job's first ray
  Health health;
  bool operator==(const PartialRecord&) const = default;
};

struct RawHeader;

class PartialLog {
 public:
  ~PartialLog();

  struct Place {
    std::uint32_t segment = 0;
    std::uint64_t offset = 0;  // position of the EXR bytes in the segment
    std::uint32_t bytes = 0;
    std::uint64_t check = 0;  // first 8 bytes of the SHA-256 of the EXR bytes
  };
  struct Entry {
    PartialRecord record;
    Place place;
  };

  // Reads the records of all segments in `folder`, in order. EXR bytes are verified only in segments without
  // an index, such as the last one: a segment is synced before it gets an index. A torn record at the end of
  // the last segment is cut off. If a part of a segment cannot be read (an error of the disk), its records
  // stay in the file but are not found, and new records go to another segment. open() creates no files; the
  // first append() does, so that a waiting job has none.
  static Result<std::unique_ptr<PartialLog>> open(std::filesystem::path folder);

  const std::vector<Entry>& found() const { return found_; }  // records found by open()
  void forget_found() { std::vector<Entry>().swap(found_); }

  // Writes one record. On an error, what was written of the record is cut off; if that fails too, later
  // records go to a new segment.
  Result<Place> append(const PartialRecord& record, std::span<const std::byte> exr);
  // Makes the records appended so far durable. Error: the records appended since the last successful sync()
  // may be lost in a crash; the caller may append them again.
  Result<void> sync();
  // Reads the EXR bytes and verifies their checksum.
  Result<std::vector<std::byte>> read(const Place& place) const;

 private:
  explicit PartialLog(std::filesystem::path folder);
  std::filesystem::path segment_path(std::uint32_t segment) const;
  std::filesystem::path index_path(std::uint32_t segment) const;
  Result<bool> scan(std::uint32_t segment, bool last);
  bool scan_index(std::uint32_t segment, const File& file, std::uint64_t size);
  void finish_segment();
  Result<void> start_segment(std::uint32_t segment);
  Result<void> flush();

  std::filesystem::path folder_;
  File current_;
  std::uint32_t segment_ = 0;
  std::uint64_t size_ = 0;  // bytes in the current segment
  bool unsynced_ = false;
  std::optional<Error> lost_;       // set if a full segment could not be synced; reported by the next sync()
  std::vector<RawHeader> headers_;  // headers of the records in the current segment
  std::vector<Entry> found_;
};

}  // namespace ls::coordinator
