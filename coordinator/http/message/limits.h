// All limits of the HTTP server. Sizes in bytes, times in seconds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "coordinator/base/limits.h"

namespace ls::http {

// Greatest body of each route
inline constexpr std::uint64_t kMaxJobJson = 4u << 20;  // POST /jobs with application/json: names and digests
inline constexpr std::uint64_t kMaxDigestList = 8u << 20;    // POST /blobs/missing
inline constexpr std::uint64_t kMaxControlJson = 64u << 10;  // PATCH /jobs/ID and other short JSON
inline constexpr std::uint64_t kMaxSessionJson = 4u << 10;   // POST /session

// Contents of requests
inline constexpr int kMaxJsonDepth = 16;             // levels of JSON; bounds the recursion that prints it
inline constexpr std::size_t kMaxDigests = 100'000;  // digests in one POST /blobs/missing
inline constexpr std::size_t kMaxAssetName = 1024;   // characters
inline constexpr std::size_t kMaxTarget = 8u << 10;  // request target
inline constexpr std::size_t kMaxQueryParameters = 256;

// Bundles
inline constexpr std::size_t kMaxBundleEntries = coordinator::limits::kMaxAssets;  // files and folders
inline constexpr std::size_t kMaxBundleNames = 16u << 20;    // bytes of all names together
inline constexpr std::uint64_t kMaxArchiveList = 32u << 20;  // a zip's directory, which is read as a whole
// An archive may unpack to this many bytes per byte of its own size...
inline constexpr std::uint64_t kMaxBundleRatio = 200;
// ...plus this many bytes, because a small archive of empty grids may compress even better
inline constexpr std::uint64_t kBundleSlack = 64u << 20;

// Buffers
inline constexpr std::size_t kReadBuffer = 64u << 10;  // per connection
// Bytes of a request's body that are passed to the disk at once
inline constexpr std::size_t kBodyChunk = 256u << 10;
// Bytes written to a client between two checks of its deadline
inline constexpr std::size_t kWriteSlice = 256u << 10;
// Bytes of request bodies that all connections together may hold in memory
inline constexpr std::uint64_t kMaxBuffered = 256u << 20;
// Bytes of answers that all connections together may hold in memory, not counting bodies in files. A single
// answer that is larger than this is sent once no other answer is in memory.
inline constexpr std::uint64_t kMaxAnswers = 256u << 20;
// Answers up to this size are not counted in kMaxAnswers
inline constexpr std::uint64_t kSmallAnswer = 64u << 10;
// Bytes that are read and dropped after an early rejection (see linger_seconds)
inline constexpr std::uint64_t kLingerBytes = 16u << 20;

inline constexpr std::int64_t kSessionSeconds = 12 * 3600;
inline constexpr std::size_t kMaxClosedSessions = 1000;  // of one token

// Limits that tests and the operator's config file may change
struct Limits {
  // PUT /blobs/SHA256, and each file of a bundle
  std::uint64_t blob_bytes = coordinator::limits::kMaxBlobBytes;
  std::uint64_t bundle_bytes = std::uint64_t{16} << 30;    // POST /jobs with an archive
  std::uint64_t unpacked_bytes = std::uint64_t{64} << 30;  // all files of a bundle
  std::size_t header_bytes = 16u << 10;
  std::size_t connections = 512;
  // How many of `connections` may be event streams; the rest is for requests.
  std::size_t event_streams = 128;
  std::size_t event_queue = 4096;  // events waiting for one reader
  std::size_t event_queue_bytes = 4u << 20;
  double header_seconds = 10;  // from the first byte of a request to the end of its header
  double idle_seconds = 60;    // a kept-alive connection is closed after this time without a request
  // A body (in either direction) is cut off when its transfer takes longer than body_grace_seconds + (bytes
  // so far) / min_rate. So a transfer of `length` bytes takes at most body_grace_seconds + length / min_rate,
  // and a stalled one is cut off after the grace time, for any announced length.
  double body_grace_seconds = 15;
  double min_rate = 8u << 10;     // bytes per second
  double heartbeat_seconds = 15;  // interval of the comments that keep a silent event stream alive
  // After an early rejection the rest of the body is read for this long: closing at once could lose the
  // answer
  double linger_seconds = 3;
  // Requests with one token or, without a token, from one address; 0: no limit. The burst is twice as large
  double requests_per_second = 500;
  // Requests with a wrong token from one address; the burst has the same size. Further ones are answered
  // with 429. 0: no limit
  double wrong_tokens_per_minute = 20;
  double stop_seconds = 5;  // how long a stopping coordinator waits for open requests
  int quick_threads = 2;    // for answers from memory
  int remote_threads = 8;   // for requests to other machines: blob stores, other coordinators
  int user_priority = 0;    // highest priority that a submit token may give to a job
  int slow_threads = 4;     // for reading scenes, writing images and blobs
  int bundle_threads = 2;   // for unpacking bundles, which thus never occupy the slow threads
  // Folder for bundles while they are read; empty: the system's temporary folder
  std::filesystem::path spool;
};

}  // namespace ls::http
