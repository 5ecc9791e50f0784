// The interface through which the agent renders units. Its implementations are the renderer in this process,
// the renderer in a child process, and the fake renderer.
#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "core/base/error.h"
#include "core/image/film/partial.h"
#include "util/protocol/messages.h"
#include "worker/render/render.h"

namespace ls::worker {

// A job whose blobs (scene and assets) are all files on this machine.
struct LocalJob {
  JobBrief brief;
  std::filesystem::path scene;                     // file of the canonical scene
  std::map<Digest, std::filesystem::path> assets;  // files of the assets, by digest
};

// Identifies the world of a job (its scene, ready to render). The job's id alone does not identify it: a
// coordinator whose data was lost or replaced may give the id of an old job to a new one.
struct WorldKey {
  JobId job;
  Digest scene, settings;
  auto operator<=>(const WorldKey&) const = default;
};
inline WorldKey key_of(const JobBrief& brief) { return {brief.job, brief.scene, brief.settings_digest}; }

struct RenderedUnit {
  Partial partial;  // the unit's pixel sums
  double cpu_seconds = 0;
  double wall_seconds = 0;  // wall-clock time from the first sample to the last
  Health health;
  TechniqueSet techniques;  // sampling techniques that the integrator uses for this scene
};

// Returns a failure of a unit for `reason`, marked as not the fault of the scene.
inline tl::unexpected<UnitFailure> unit_failure(std::string reason) {
  return tl::unexpected<UnitFailure>(UnitFailure{.reason = std::move(reason)});
}

// Renders units. All calls block, and the agent makes them from several threads concurrently. If the caller
// sets `stop`, the call should return early; its result is then ignored. UnitFailure::scene_at_fault is true
// if the scene caused the failure.
class RenderBackend {
 public:
  virtual ~RenderBackend() = default;
  virtual Digest numeric_class() const = 0;
  // Returns a description in words of the numeric class, that is, of the builds and CPUs that render the same
  // bits; empty: unknown
  virtual std::string platform() const { return {}; }
  // Builds the job's world (its scene, ready to render), unless it is already built. Returns a failure with
  // the reason if the world cannot be built.
  virtual tl::expected<void, UnitFailure> prepare(const LocalJob& job, const std::atomic<bool>& stop) = 0;
  virtual tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                         const std::atomic<bool>& stop) = 0;
  // Frees every world whose WorldKey contains this job id.
  virtual void forget(const JobId& job) = 0;
  virtual std::uint64_t rss_bytes() const = 0;
  // Returns an error once the backend can no longer render anything. The worker then ends with this error,
  // and the units that failed because of it are not reported as failed.
  virtual std::optional<Error> broken() const { return std::nullopt; }
  // Ends the backend: no further calls follow, and calls that still block should return soon. May be called
  // more than once.
  virtual void shutdown() {}
};

// Returns the resident bytes of the process, for rss_bytes(); 0 if it has ended.
inline std::uint64_t resident_bytes(pid_t process) {
  std::uint64_t total = 0, resident = 0;
  std::ifstream statm("/proc/" + std::to_string(process) + "/statm");
  statm >> total >> resident;
  return statm ? resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

// A backend that renders in this process and can show which sample it is rendering.
class LocalBackend : public RenderBackend {
 public:
  // Does what render() does, and keeps in `where` (null: nowhere) the pixel and number of the sample that is
  // being rendered. `where` may be in memory that another process reads. Its members are atomic and are
  // written with relaxed order.
  virtual tl::expected<RenderedUnit, UnitFailure> render_marked(const LocalJob& job, const LeaseUnit& unit,
                                                                const std::atomic<bool>& stop,
                                                                render::Breadcrumb* where) = 0;
  tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                 const std::atomic<bool>& stop) final {
    return render_marked(job, unit, stop, nullptr);
  }
};

}  // namespace ls::worker
