// All limits of the HTTP server. Sizes are in bytes, times in seconds. A blob is a file of a scene; a bundle
// is an archive with a scene and all its files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "coordinator/base/limits.h"

namespace ls::http {

// Greatest size of a request body, by route. The limits of the other routes are in the struct Limits below

// POST /jobs with application/json, which has the names and digests of the scene's files
inline constexpr std::uint64_t kMaxJobJson = 4u << 20;
inline constexpr std::uint64_t kMaxDigestList = 8u << 20;    // POST /blobs/missing
inline constexpr std::uint64_t kMaxControlJson = 64u << 10;  // PATCH /jobs/ID and other short JSON
inline constexpr std::uint64_t kMaxSessionJson = 4u << 10;   // POST /session

// Contents of requests

// Greatest depth of nested JSON. There is a limit because the function that prints JSON is recursive
inline constexpr int kMaxJsonDepth = 16;
inline constexpr std::size_t kMaxDigests = 100'000;  // number of digests in one POST /blobs/missing
inline constexpr std::size_t kMaxAssetName = 1024;   // length of a file name in a bundle
// Length of the request target: path and query of the address
inline constexpr std::size_t kMaxTarget = 8u << 10;
inline constexpr std::size_t kMaxQueryParameters = 256;

// Bundles

// Number of files and folders in a bundle
inline constexpr std::size_t kMaxBundleEntries = coordinator::limits::kMaxAssets;
inline constexpr std::size_t kMaxBundleNames = 16u << 20;  // length of all file names of a bundle together
// Size of a zip's directory, which is held in memory as a whole
inline constexpr std::uint64_t kMaxArchiveList = 32u << 20;
// An archive of n bytes may unpack to at most n * kMaxBundleRatio + kBundleSlack bytes. kBundleSlack is for
// small archives of empty grids, which may be compressed by a higher ratio than kMaxBundleRatio
inline constexpr std::uint64_t kMaxBundleRatio = 200;
inline constexpr std::uint64_t kBundleSlack = 64u << 20;

// Buffers

inline constexpr std::size_t kReadBuffer = 64u << 10;  // buffer for the bytes received from one connection
// Bytes of a request's body that are passed to the disk at once
inline constexpr std::size_t kBodyChunk = 256u << 10;
// Bytes written to a client between two checks of its deadline
inline constexpr std::size_t kWriteSlice = 256u << 10;
// Greatest number of bytes of a body that are read and dropped after an early rejection (see linger_seconds)
inline constexpr std::uint64_t kLingerBytes = 16u << 20;

// Memory that an answer about an image takes for each of its pixels while it is made, beside its film:
// report.html of 8192 x 8192 pixels takes 14 bytes, image.exr with its error layers 32
inline constexpr std::uint64_t kMemoryPerPixel = 32;

inline constexpr std::int64_t kSessionSeconds = 12 * 3600;
inline constexpr std::size_t kMaxClosedSessions = 1000;  // closed sessions remembered per token, at most

// Threads for one kind of work
struct PoolSize {
  std::size_t threads = 1;
  std::size_t each = 1;  // of these, at most so many for one token or, without a token, for one address
};

// Limits that tests and the operator's config file may change
struct Limits {
  // Greatest size of a blob, whether it is the body of PUT /blobs/SHA256 or a file in a bundle
  std::uint64_t blob_bytes = coordinator::limits::kMaxBlobBytes;
  // Greatest size of a bundle, which is the body of a POST /jobs with an archive
  std::uint64_t bundle_bytes = std::uint64_t{16} << 30;
  std::uint64_t unpacked_bytes = std::uint64_t{64} << 30;  // size of all files of a bundle together, unpacked
  std::size_t header_bytes = 16u << 10;
  std::size_t connections = 512;
  // Of these, at most so many of one token; one that is silent between requests is closed for a new one
  std::size_t connections_each = 128;
  // Connections of one address (an IPv6 /64 counts as one) on which nobody has shown a token yet. For a new
  // one the oldest is closed.
  std::size_t connections_of_address = 32;
  // How many of `connections` may be event streams; the rest is for requests.
  std::size_t event_streams = 128;
  // Of these, at most so many of one token once half of all are open
  std::size_t event_streams_each = 32;
  // Bytes of request bodies, and of answers that are not in files, that all connections together may hold in
  // memory; of each a quarter for one token once half is used (net/shares.h)
  std::uint64_t body_memory = 256u << 20;
  std::uint64_t answer_memory = 256u << 20;
  // Memory in which answers about images are made, half of it for one token. The largest image takes 2 GB.
  std::uint64_t picture_memory = std::uint64_t{4} << 30;
  std::size_t event_queue = 4096;  // number of events that may wait for one reader of an event stream
  std::size_t event_queue_bytes = 4u << 20;
  double header_seconds = 10;  // allowed from the first byte of a request to the end of its header
  double idle_seconds = 60;    // a kept-alive connection is closed after this time without a request
  // A body (in either direction) is cut off when it is body_grace_seconds behind min_rate, at any time
  // (net/pace.h). So a transfer of `length` bytes takes at most body_grace_seconds + length / min_rate, and a
  // stalled one is cut off after the grace time, however fast its first bytes came.
  double body_grace_seconds = 15;
  double min_rate = 8u << 10;  // in bytes per second
  // A silent event stream gets a comment this often, to keep the connection alive
  double heartbeat_seconds = 15;
  // If a request is rejected before its body was read, the rest of the body is still read for this long: if
  // the server closed the connection at once, the client could lose the answer
  double linger_seconds = 3;
  // Allowed requests per second in the long run, with one token or (without a token) from one address; 0: no
  // limit. A burst of up to twice this number is allowed
  double requests_per_second = 500;
  // Allowed requests per minute with a wrong token from one address, even if all of them come at once.
  // Further ones are answered with 429. 0: no limit
  double wrong_tokens_per_minute = 20;
  double stop_seconds = 5;  // how long a stopping coordinator waits for open requests
  int user_priority = 0;    // highest priority that a submit token may give to a job
  PoolSize quick{4, 2};     // requests that are answered from memory
  PoolSize slow{8, 3};      // reading scenes, writing images and blobs
  PoolSize bundles{3, 1};   // unpacking bundles
  PoolSize remote{12, 6};   // requests to other machines: blob stores, other coordinators
  // Folder for bundles while they are read; empty: the system's temporary folder
  std::filesystem::path spool;
};

}  // namespace ls::http
