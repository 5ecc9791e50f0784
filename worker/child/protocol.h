// The protocol between agent and render child. Requests and replies are structs of fixed size over a socket
// pair per channel: one channel for control and one for each slot (render thread). Each slot has an area of
// shared memory, which holds the pixel sums of its finished unit, and the pixel and number of the sample that
// it is rendering. Agent and child are the same executable, so plain structs suffice. A malicious scene may
// take over the child: the agent uses no size or index that the child has written without checking it, and
// the shared memory is sealed, so that its size cannot change.
#pragma once

#include <atomic>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/base/error.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"
#include "util/protocol/limits.h"
#include "util/sandbox/channel.h"
#include "worker/child/child.h"
#include "worker/render/render.h"

namespace ls::worker::child {

// File descriptors in the child, set up by posix_spawn. Render slot i has the channel kFirstSlotFd + i.
inline constexpr int kSharedMemoryFd = 3;
inline constexpr int kControlFd = 4;
inline constexpr int kFirstSlotFd = 5;
inline constexpr int kMostSlots = kMostChildThreads;

// Upper limit for the bytes that one asset takes in the text of a job (to_text()). The text has the asset's
// digest (64 bytes), size (up to 20) and name, and then the digest again and the path. JSON escapes may
// double the bytes of names and paths. The last 64 bytes are for punctuation.
inline constexpr std::size_t kAssetTextBytes = 2 * 64 + 20 + 2 * limits::kNameBytes + 2 * PATH_MAX + 64;
// Upper limit for the bytes of the whole text of a job. The settings are a JSON string, whose escapes may
// double its bytes. Besides all assets there are the path of the scene file and small members; the room of
// two assets is enough for them.
inline constexpr std::size_t kTextBytes =
    2 * limits::kSettingsBytes + (limits::kAssetsPerJob + 2) * kAssetTextBytes;
inline constexpr std::size_t kReasonBytes = 64 << 10;  // upper limit for the bytes of a reply's text

// Number of floats in the largest partial (the pixel sums of one unit) that fits into a message: that of a
// tile of 202 x 202 pixels with 6 floats each, without AOVs.
inline constexpr std::size_t kSlotFloats = 202 * 202 * 6;

enum class Kind : std::uint32_t { hello, prepare, forget, render };

// A request of the agent to the child, followed by `text_bytes` bytes of text. The members after `job`
// describe the unit and are used by `render` only.
struct Request {
  Kind kind{};
  // Length of the text that follows: for `prepare` the text of the job (to_text()); for other kinds 0
  std::uint32_t text_bytes = 0;
  std::uint64_t job = 0;  // number that the agent has given the job
  std::uint32_t tile = 0, round = 0;
  PixelRect rect;
  SampleRange samples;
};

enum class Outcome : std::uint32_t { ok, scene_at_fault, failed, out_of_memory, stopped };

struct Reply {
  Outcome outcome{};
  // Length of the text that follows: the reason of a failure, the health of a rendered unit that is not
  // clean, or the platform in the reply to `hello`.
  std::uint32_t text_bytes = 0;
  Digest numeric_class;  // only in the reply to `hello`
  double cpu_seconds = 0, wall_seconds = 0;
  std::uint32_t techniques = 0;  // TechniqueSet::bits() of a rendered unit
};
static_assert(std::is_trivially_copyable_v<Request> && std::is_trivially_copyable_v<Reply>);

// The data of one render thread that agent and child share.
struct Slot {
  render::Breadcrumb where;
  std::atomic<bool> stop{false};     // set by the agent to make the child abandon the unit
  std::atomic<bool> crashed{false};  // set by the child's signal handler if this thread crashed
  float sums[kSlotFloats];
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

// The shared memory: this, followed by the slots.
struct alignas(64) Shared {
  std::atomic<bool> stop_build{false};  // set by the agent to make the child abandon the world that it builds
  Slot* slots() { return reinterpret_cast<Slot*>(this + 1); }
  static std::size_t bytes(int slots) {
    return sizeof(Shared) + sizeof(Slot) * static_cast<std::size_t>(slots);
  }
};
static_assert(alignof(Slot) <= alignof(Shared));

// Converts a LocalJob (a job whose files are on this machine) to the text of a `prepare` request, and back.
std::string to_text(const LocalJob& job);
Result<LocalJob> from_text(std::string_view text);

}  // namespace ls::worker::child
