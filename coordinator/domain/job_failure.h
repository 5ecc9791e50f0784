// Why a job failed of which a unit could not be rendered, as data for clients. describe() gives the same as a
// text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"

namespace ls::coordinator {

// `unit`: the unit failed on several workers. `scene`: the last worker said that the scene is at fault.
// `no_worker`: every worker has failed too many units of the job.
enum class FailureKind { unit, scene, no_worker };
constexpr std::string_view to_string(FailureKind kind) {
  constexpr std::string_view kWords[] = {"unit", "scene", "no_worker"};
  return kWords[static_cast<std::size_t>(kind)];
}

struct JobFailure {
  // A failed attempt to render the unit
  struct Attempt {
    std::string worker;                        // its name
    std::string reason;                        // as the worker reported it; empty: it gave none
    std::optional<int> signal;                 // signal that ended the render process
    std::optional<std::pair<int, int>> pixel;  // pixel (x, y) that was being rendered
    std::optional<std::uint64_t> sample;
    bool operator==(const Attempt&) const = default;
  };
  FailureKind kind = FailureKind::unit;
  TileIndex tile = 0;
  PixelRect rect;  // of the tile, in pixels
  RoundIndex round = 0;
  SampleRange samples;                 // of the round
  std::optional<std::uint32_t> frame;  // number of the frame that failed; set only for a sequence
  std::vector<Attempt> attempts;       // the latest ones, in their order
  std::string replay;  // command that renders the failed pixel again; empty: the pixel is unknown
  bool operator==(const JobFailure&) const = default;
};

// Returns the error message of the failed job for its user. It names the unit, what each worker reported, and
// the command.
std::string describe(const JobFailure& failure);

}  // namespace ls::coordinator
