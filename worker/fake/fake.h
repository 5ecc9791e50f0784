// The fake renderer: every unit is a pure function of its job's seed, its pixels and its samples
// (common/image/film/fake_pixels.h). It opens no scene file. For tests of everything but rendering, and load
// tests of a farm.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "worker/agent/backend.h"

namespace ls::worker {

// A fault injected into chosen units, for tests.
struct FakeFault {
  enum class Kind { none, crash, hang, memory, wrong, unhealthy } kind = Kind::none;
  // Selects units by the job's seed, tile and round. Negative: any.
  std::int64_t seed = -1, tile = -1, round = -1;
};
// "KIND[,seed=S][,tile=T][,round=R]" with KIND one of crash, hang, memory, wrong, unwell; empty: none.
// `unwell`: the pixels are right, but two infinite samples are reported at the tile's first pixel.
Result<FakeFault> parse_fake_fault(std::string_view text);

Digest fake_numeric_class();  // SHA-256 of "fake"

struct FakeOptions {
  Duration delay{};           // sleep per unit
  double sample_seconds = 0;  // additional time per sample of a pixel, reported as CPU time
  FakeFault fault;
  Digest numeric_class = fake_numeric_class();  // set to another one to simulate another class of machine
};

std::unique_ptr<LocalBackend> make_fake_backend(FakeOptions options);

}  // namespace ls::worker
