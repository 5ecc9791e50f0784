// The fake renderer: every unit is a pure function of its job's seed, its pixels and its samples
// (common/image/fake_pixels.h). It opens no scene file. For tests of everything but rendering, and for load
// tests of a farm.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "worker/backend.h"

namespace ls::worker {

// Misbehaviour on chosen units, for tests.
struct FakeFault {
  enum class Kind { none, crash, hang, memory, wrong, unwell } kind = Kind::none;
  // Which units: of jobs with this seed, this tile, this round. Negative: any.
  std::int64_t seed = -1, tile = -1, round = -1;
};
// "KIND[,seed=S][,tile=T][,round=R]" with KIND one of crash, hang, memory, wrong, unwell; empty: none.
// `unwell`: the pixels are right, but it tells of two infinite samples at the tile's first pixel.
Result<FakeFault> parse_fake_fault(std::string_view text);

Digest fake_numeric_class();  // SHA-256 of "fake"

struct FakeOptions {
  Duration delay{};  // of each unit; waited for
  double sample_seconds =
      0;  // that each sample of a pixel takes, besides; told as CPU time, as if it were worked
  FakeFault fault;
  Digest numeric_class = fake_numeric_class();  // another one, to stand for another kind of machine
};

std::unique_ptr<LocalBackend> make_fake_backend(FakeOptions options);

}  // namespace ls::worker
