// What the gRPC port bounds.
#pragma once

#include <cstddef>

namespace ls::coordinator::rpc {

inline constexpr int kWorkStreams =
    16'384;                           // workers connected at once, as many as the farm knows (kMaxWorkers)
inline constexpr int kFetches = 512;  // blob transfers at once; a worker that finds none left tries again
inline constexpr int kReadThreads =
    64;  // that read blobs for them; most wait, where one must be fetched first
inline constexpr std::size_t kQueuedMessages = 8192;  // to one worker that does not read; then it is cut off
inline constexpr int kUnreadBytes = 64 << 10;         // that one worker may send ahead of what is read of it
inline constexpr int kHelloSeconds = 20;              // from the opening of a stream to its hello
inline constexpr int kHandshakeMs = 10'000;
// Keepalive, the same on both sides (worker/client/channel.cpp): a peer that vanished is noticed within 30 s.
inline constexpr int kKeepaliveMs = 20'000;
inline constexpr int kKeepaliveTimeoutMs = 10'000;
// What a client may do without being sent away (GOAWAY too_many_pings).
inline constexpr int kPingsNotOftenerMs = 5'000;

}  // namespace ls::coordinator::rpc
