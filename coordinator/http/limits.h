// Every bound that the HTTP door sets on a stranger, in one place. Sizes in bytes, times in seconds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace ls::http {

// ---- bodies, per route ----
inline constexpr std::uint64_t kMaxSceneXml = 32u << 20;  // POST /jobs with application/xml
inline constexpr std::uint64_t kMaxJobJson = 4u << 20;  // POST /jobs with application/json: names and digests
inline constexpr std::uint64_t kMaxDigestList = 8u << 20;    // POST /blobs/missing
inline constexpr std::uint64_t kMaxControlJson = 64u << 10;  // PATCH /jobs/ID
inline constexpr std::uint64_t kMaxSessionJson = 4u << 10;   // POST /session

// ---- what is inside ----
inline constexpr int kMaxJsonDepth = 16;             // deeper values would be printed by recursion
inline constexpr std::size_t kMaxDigests = 100'000;  // in one POST /blobs/missing
inline constexpr std::size_t kMaxAssets = 100'000;   // of one job
inline constexpr std::size_t kMaxAssetName = 1024;   // characters
inline constexpr std::size_t kMaxTarget = 8u << 10;  // request target
inline constexpr std::size_t kMaxQueryParameters = 256;
inline constexpr std::size_t kMaxIdLength = 64;  // of a job's id
inline constexpr double kMaxExposure = 32;       // stops, either way

// ---- bundles ----
inline constexpr std::size_t kMaxBundleEntries = kMaxAssets;  // files and folders
inline constexpr std::size_t kMaxBundleNames = 16u << 20;     // bytes of all names together
inline constexpr std::size_t kMaxBundleJobJson = 1u << 20;    // job.json
inline constexpr std::uint64_t kMaxArchiveList = 32u << 20;   // a zip's list, which is read as a whole
inline constexpr std::uint64_t kMaxBundleRatio = 200;         // unpacked bytes per byte of the archive ...
inline constexpr std::uint64_t kBundleSlack = 64u << 20;      // ... beyond these: empty grids pack well

// ---- buffers ----
inline constexpr std::size_t kReadBuffer = 64u << 10;   // per connection
inline constexpr std::size_t kBodyChunk = 256u << 10;   // handed to the disk at once
inline constexpr std::size_t kWriteSlice = 256u << 10;  // between two looks at the clock
inline constexpr std::uint64_t kMaxBuffered = 256u
                                              << 20;  // request bodies in memory, all connections together
// Bodies of answers in memory, of all connections together; what is larger goes when nothing else does, and
// what lies in a file is not counted.
inline constexpr std::uint64_t kMaxAnswers = 256u << 20;
inline constexpr std::uint64_t kSmallAnswer = 64u << 10;  // is never refused, nor counted
inline constexpr std::uint64_t kLingerBytes = 16u << 20;  // read and thrown away after an early refusal

inline constexpr std::int64_t kSessionSeconds = 12 * 3600;
inline constexpr std::size_t kMaxRevokedSessions = 10'000;

// Those that tests and an operator's config file may change.
struct Limits {
  std::uint64_t blob_bytes = std::uint64_t{64} << 30;      // PUT /blobs/SHA256, and one file of a bundle
  std::uint64_t bundle_bytes = std::uint64_t{16} << 30;    // POST /jobs with an archive
  std::uint64_t unpacked_bytes = std::uint64_t{64} << 30;  // all files of a bundle
  std::size_t header_bytes = 16u << 10;
  std::size_t connections = 512;
  std::size_t event_streams = 128;  // of the connections; the rest stays free for requests
  std::size_t event_queue = 4096;   // events waiting for one reader
  std::size_t event_queue_bytes = 4u << 20;
  double header_seconds = 10;  // from a request's first byte to the end of its header
  double idle_seconds = 60;    // of a kept connection between two requests
  // A body (either way) is cut when it is slower than this: allowed seconds = grace + bytes so far /
  // min_rate. So the whole takes at most grace + length / min_rate, and one that stalls is cut after grace,
  // whatever it had announced.
  double body_grace_seconds = 15;
  double min_rate = 8u << 10;     // bytes per second
  double heartbeat_seconds = 15;  // comments on a silent event stream
  double linger_seconds = 3;      // reading on after an early refusal, so that the answer arrives
  double requests_per_second =
      500;  // of one token, or of one address without any; 0: no limit. Twice as many at once
  double wrong_tokens_per_minute = 20;  // of one address, as many at once; then 429; 0: no limit
  double stop_seconds = 5;              // for requests under way when the coordinator stops
  int quick_threads = 2;                // for answers out of memory
  int away_threads = 8;         // for questions to other machines: stores of blobs, other coordinators
  int user_priority = 0;        // the highest that a job of a submit token may have
  int slow_threads = 4;         // for reading scenes, writing images and blobs
  int bundle_threads = 2;       // for unpacking bundles, so that they never fill the slow ones
  std::filesystem::path spool;  // where bundles lie while they are read; empty: the system's temporary folder
};

}  // namespace ls::http
