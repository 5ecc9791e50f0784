// What renders units for an agent: the renderer in this process, the renderer in a child process, or the fake.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <variant>

#include "common/base/error.h"
#include "common/image/partial.h"
#include "common/protocol/messages.h"

namespace ls::worker {

// A job as a backend sees it: every blob is a file on this machine.
struct LocalJob {
  JobBrief brief;
  std::filesystem::path scene;                       // canonical scene
  std::map<Digest, std::filesystem::path> assets;    // by digest
};

struct RenderedUnit {
  Partial partial;
  double cpu_seconds = 0;
  UnitHealth health;
};

// Blocking calls, made from several threads of the agent at once (one a render thread). `stop` asks for an early return with
// Errc::failed_precondition. A UnitFailure says whose fault it was.
class RenderBackend {
 public:
  virtual ~RenderBackend() = default;
  virtual Digest numeric_class() const = 0;
  // Makes the job's world ready, or says why it can't be; reused while it is the current one.
  virtual tl::expected<void, UnitFailure> prepare(const LocalJob& job) = 0;
  virtual tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                         const std::atomic<bool>& stop) = 0;
  virtual void forget(const JobId& job) = 0;
  virtual std::uint64_t rss_bytes() const = 0;
};

}  // namespace ls::worker
