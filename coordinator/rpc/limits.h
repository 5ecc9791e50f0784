// Limits of the gRPC port.
#pragma once

#include <cstddef>

namespace ls::coordinator::rpc {

// Workers connected at once; the same as kMaxWorkers
inline constexpr int kWorkStreams = 16'384;
inline constexpr int kFetches = 512;  // blob transfers at once; a worker beyond that tries again
// Threads that read blobs for the transfers; most wait if a blob must be fetched first
inline constexpr int kReadThreads = 64;
// Messages to a worker that does not read; above this it is disconnected
inline constexpr std::size_t kQueuedMessages = 8192;
inline constexpr int kUnreadBytes = 64 << 10;  // that a worker may send before they are read
inline constexpr int kHelloSeconds = 20;       // from the opening of a stream to its hello
inline constexpr int kHandshakeMs = 10'000;
// Keepalive, the same on both sides (worker/client/channel.cpp): a vanished peer is noticed within 30 s.
inline constexpr int kKeepaliveMs = 20'000;
inline constexpr int kKeepaliveTimeoutMs = 10'000;
// Clients that ping more often are disconnected (GOAWAY too_many_pings).
inline constexpr int kPingsNotOftenerMs = 5'000;

}  // namespace ls::coordinator::rpc
