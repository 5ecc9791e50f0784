// The fake renderer, for tests of everything but rendering, and for load tests of a farm. Its result for a
// unit is a pure function of the job's seed, the pixels and the samples (worker/fake/fake_pixels.h). It opens
// no scene file.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "core/base/clock.h"
#include "core/base/error.h"
#include "worker/agent/backend.h"

namespace ls::worker {

// A fault injected into chosen units, for tests.
struct FakeFault {
  enum class Kind { none, crash, hang, memory, wrong, unhealthy } kind = Kind::none;
  // The fault is injected into units whose job has this seed, whose tile has this index, and whose round (the
  // number of the unit's range of samples) is this one. A negative value matches all units.
  std::int64_t seed = -1, tile = -1, round = -1;
};
// Parses "KIND[,seed=S][,tile=T][,round=R]" with KIND one of crash, hang, memory, wrong, unwell; empty: no
// fault. `unwell` is Kind::unhealthy: the pixels are right, but the unit reports two infinite samples at the
// tile's first pixel.
Result<FakeFault> parse_fake_fault(std::string_view text);

Digest fake_numeric_class();  // returns the SHA-256 of "fake"

struct FakeOptions {
  Duration delay{};           // how long the renderer sleeps for each unit
  double sample_seconds = 0;  // further sleep per sample of a pixel; it counts as CPU time
  FakeFault fault;
  // Identifies machines that render the same bits. Tests set another value to simulate a different machine.
  Digest numeric_class = fake_numeric_class();
  std::string platform = "fake";
};

std::unique_ptr<LocalBackend> make_fake_backend(FakeOptions options);

}  // namespace ls::worker
