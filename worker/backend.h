// What renders units for an agent: the renderer in this process, the renderer in a child process, or the
// fake.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <variant>

#include "common/base/error.h"
#include "common/image/partial.h"
#include "common/protocol/messages.h"
#include "worker/render/render.h"

namespace ls::worker {

// A job as a backend sees it: every blob is a file on this machine.
struct LocalJob {
  JobBrief brief;
  std::filesystem::path scene;                     // canonical scene
  std::map<Digest, std::filesystem::path> assets;  // by digest
};

// Which world it is rendered in. The job's id is not enough: a coordinator whose data were replaced may give
// it to another job.
struct WorldKey {
  JobId job;
  Digest scene, settings;
  auto operator<=>(const WorldKey&) const = default;
};
inline WorldKey key_of(const JobBrief& brief) { return {brief.job, brief.scene, brief.settings_digest}; }

struct RenderedUnit {
  Partial partial;
  double cpu_seconds = 0;
  double wall_seconds = 0;  // from the first sample to the last
  Health health;
};

// Blocking calls, made from several threads of the agent at once (one a render thread). `stop` asks for an
// early return; what comes back then is looked at by nobody. A UnitFailure says whose fault it was.
class RenderBackend {
 public:
  virtual ~RenderBackend() = default;
  virtual Digest numeric_class() const = 0;
  // Makes the job's world ready, or says why it can't be; reused while it is the current one.
  virtual tl::expected<void, UnitFailure> prepare(const LocalJob& job) = 0;
  virtual tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                         const std::atomic<bool>& stop) = 0;
  virtual void forget(const JobId& job) = 0;  // all that had this id
  virtual std::uint64_t rss_bytes() const = 0;
  // Why it cannot render anything any more, whatever it is asked: the worker ends with this. The failures of
  // units that come with it are not the units' fault.
  virtual std::optional<Error> broken() const { return std::nullopt; }
  // Nothing more will be asked: calls that are still blocked should come back soon. May be called more than
  // once.
  virtual void shutdown() {}
};

// A backend that renders in this very process and can say where it is.
class LocalBackend : public RenderBackend {
 public:
  // `where` may be null. Its stores are relaxed; whoever reads it may be another process.
  virtual tl::expected<RenderedUnit, UnitFailure> render_marked(const LocalJob& job, const LeaseUnit& unit,
                                                                const std::atomic<bool>& stop,
                                                                render::Breadcrumb* where) = 0;
  tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                 const std::atomic<bool>& stop) final {
    return render_marked(job, unit, stop, nullptr);
  }
};

}  // namespace ls::worker
