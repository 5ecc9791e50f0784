#include "worker/inprocess.h"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <mutex>
#include <vector>

#include "core/base/clock.h"
#include "core/scene/analysis/needs.h"
#include "core/scene/json/serialize.h"
#include "core/scene/schema/integrators.h"
#include "worker/render/base/build_stop.h"

namespace ls::worker {
namespace {

// Makes a UnitFailure from an error. invalid_argument means that the scene is at fault; after any other error
// (no memory, an unreadable file) the unit may succeed on another machine.
tl::unexpected<UnitFailure> failed(const Error& error) {
  return tl::unexpected<UnitFailure>(
      UnitFailure{.scene_at_fault = error.code == Errc::invalid_argument, .reason = error.message});
}

// A scene's needs are the features and files that rendering it takes. Worker and coordinator both derive them
// from the scene, and the coordinator serves only the files that are among the needs it derived. So this
// function checks that the needs that this worker derives equal those in the job's brief, which the
// coordinator has derived.
tl::expected<void, UnitFailure> check_needs(const Scene& scene, const JobBrief& brief) {
  if (brief.needs.empty()) return {};
  const std::string own =
      canonical_json(scene::needs_of(scene, scene::sees_media(brief.settings.integrator)));
  const std::string other = scene::first_difference(own, brief.needs);
  if (other.empty()) return {};
  return unit_failure(fmt::format(
      "coordinator and worker do not agree on what the scene needs ({}; here: this worker, there: "
      "the coordinator): they are of different versions; install the same one on both",
      other));
}

Result<std::string> read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) return fail(Errc::internal, fmt::format("cannot read {}", path.string()));
  return text;
}

class InProcessBackend final : public LocalBackend {
 public:
  explicit InProcessBackend(int threads) : threads_(threads) {}

  Digest numeric_class() const override { return render::numeric_class(); }
  std::string platform() const override { return render::platform(); }

  tl::expected<void, UnitFailure> prepare(const LocalJob& job, const std::atomic<bool>& stop) override {
    if (world(job.brief)) return {};
    const auto text = read_file(job.scene);
    if (!text) return failed(text.error());
    const auto scene = deserialize_scene(*text);
    if (!scene) return failed(scene.error());
    if (const auto same = check_needs(*scene, job.brief); !same) return tl::unexpected(same.error());
    const render::BuildStop stoppable(stop);
    auto built = render::build_world(*scene, job.brief.settings, job.assets, threads_);
    if (!built) return failed(built.error());
    const std::lock_guard lock(mutex_);
    worlds_[key_of(job.brief)] = std::move(*built);
    return {};
  }

  tl::expected<RenderedUnit, UnitFailure> render_marked(const LocalJob& job, const LeaseUnit& unit,
                                                        const std::atomic<bool>& stop,
                                                        render::Breadcrumb* where) override {
    const auto ready = world(job.brief);
    if (!ready) return unit_failure("the job was not prepared");
    const double start = thread_cpu_seconds();
    const TimePoint begin = clock_.now();
    render::Breadcrumb own;
    render::TileResult tile =
        render::render_tile(*ready, unit.rect, unit.samples, &stop, where ? where : &own);
    if (tile.stopped) return unit_failure("told to stop");
    RenderedUnit out;
    const JobBrief& brief = job.brief;
    out.partial.header = {brief.scene, brief.settings_digest, numeric_class(), unit.rect, unit.samples};
    out.partial.sums = std::move(tile.sums);
    out.partial.aovs = aovs_of(brief.settings);
    out.cpu_seconds = thread_cpu_seconds() - start;
    out.wall_seconds = seconds(clock_.now() - begin);
    out.health = std::move(tile.health);
    out.health.merge(render::changed_inputs(*ready));
    out.techniques = render::techniques_of(*ready);
    return out;
  }

  void forget(const JobId& job) override {
    // The removed worlds. Declared before the lock, so that they are freed after the mutex is unlocked.
    std::vector<std::shared_ptr<const render::World>> last;
    const std::lock_guard lock(mutex_);
    std::erase_if(worlds_, [&](auto& entry) {
      const bool gone = entry.first.job == job;
      if (gone) last.push_back(std::move(entry.second));
      return gone;
    });
  }

  std::uint64_t rss_bytes() const override { return resident_bytes(::getpid()); }

 private:
  std::shared_ptr<const render::World> world(const JobBrief& brief) const {
    const std::lock_guard lock(mutex_);
    const auto it = worlds_.find(key_of(brief));
    return it == worlds_.end() ? nullptr : it->second;
  }

  const int threads_;
  const SystemClock clock_;
  mutable std::mutex mutex_;
  std::map<WorldKey, std::shared_ptr<const render::World>> worlds_;
};

}  // namespace

std::unique_ptr<LocalBackend> make_inprocess_backend(int threads) {
  return std::make_unique<InProcessBackend>(threads);
}

}  // namespace ls::worker
