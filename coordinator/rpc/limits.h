// Limits of the gRPC port.
#pragma once

#include <cstddef>

namespace ls::coordinator::rpc {

// Workers connected at once; the same as kMaxWorkers
inline constexpr int kWorkStreams = 16'384;
inline constexpr int kFetches = 512;  // blob transfers in progress; further ones are refused, and tried again
// Threads that read blobs for these transfers. They are many because most may be waiting for blobs that the
// coordinator must first fetch from another machine
inline constexpr int kReadThreads = 64;
// Messages that may wait for a worker that does not read them; a worker with more is disconnected
inline constexpr std::size_t kQueuedMessages = 8192;
// Bytes that a worker may send before the coordinator reads them.
inline constexpr int kUnreadBytes = 64 << 10;
inline constexpr int kHelloSeconds = 20;  // how long after opening its stream a worker must send its hello
inline constexpr int kHandshakeMs = 10'000;
// Keepalive, the same on both sides (worker/client/channel.cpp): a vanished peer is noticed within 30 s.
inline constexpr int kKeepaliveMs = 20'000;
inline constexpr int kKeepaliveTimeoutMs = 10'000;
// Clients that ping more often are disconnected (GOAWAY too_many_pings).
inline constexpr int kPingsNotOftenerMs = 5'000;

}  // namespace ls::coordinator::rpc
