#include "coordinator/service/state/job_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <random>

#include "coordinator/admission/admission.h"
#include "coordinator/base/limits.h"

namespace ls::coordinator {
namespace {

std::uint64_t film_bytes_of(const StoredJob& job) {
  return film_bytes_per_pixel(aovs_of(job.settings)) * job.settings.size.pixels();
}

// Returns the sum of the largest kFilmsOfSequence values.
std::uint64_t sum_of_largest(std::vector<std::uint64_t> values) {
  const std::size_t count = std::min(values.size(), limits::kFilmsOfSequence);
  std::partial_sort(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count), values.end(),
                    std::greater<>());
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += values[i];
  return sum;
}

double gigabytes(std::uint64_t bytes) { return static_cast<double>(bytes) / (std::uint64_t{1} << 30); }

}  // namespace

JobEntry::JobEntry(StoredJob job, TimePoint now)
    : stored(std::move(job)),
      settings_digest(digest_of(stored.settings)),
      grid(grid_of(stored.settings)),
      film_bytes(film_bytes_of(stored)),
      snapshots(now),
      fold_seconds(stored.totals.render_seconds) {}

void JobEntry::begin_image() {
  assembly.emplace(grid, stored.spec.target_error.has_value(), aovs_of(stored.settings));
}

void JobEntry::begin_comparison() {
  if (stored.spec.reference) reference_tiles.emplace(assembly->film());
}

void JobEntry::free_image() {
  unloaded = true;
  assembly.reset();
  reference_tiles.reset();
  log.reset();
}

double JobEntry::elapsed(TimePoint now) const { return clock.started() ? clock.shows(now) : fold_seconds; }

FrameRange Sequence::range() const {
  const StoredJob &first = frames.front()->stored, &last = frames.back()->stored;
  if (first.spec.frames) return *first.spec.frames;
  if (last.spec.frames) return *last.spec.frames;
  return {frame_of(first.id)->frame, frame_of(last.id)->frame, 1};  // if both frames' records are damaged
}

JobState Sequence::for_others() const {
  const auto in = [&](JobState state) { return in_state[static_cast<std::size_t>(state)]; };
  if (in(JobState::failed) > 0) return JobState::failed;
  if (in(JobState::cancelled) > 0) return JobState::cancelled;
  if (in(JobState::done) == frames.size()) return JobState::done;
  if (in(JobState::queued) == frames.size()) return JobState::queued;
  return in(JobState::running) > 0 || in(JobState::done) > 0 ? JobState::running : JobState::paused;
}

ReportFacts facts_of(const JobEntry& entry, TimePoint now) {
  ReportFacts facts;
  facts.job = entry.stored;
  if (facts.job.state == JobState::cancelled) facts.job.stopped = StopReason::user;
  facts.convergence = entry.points;
  facts.replay = replay_of(entry.stored);
  facts.reference_noise = entry.reference_noise;
  if (!entry.assembly) return facts;
  const Film& film = entry.assembly->film();
  facts.job.totals.health = entry.assembly->health().total();
  if (entry.clock.started()) facts.job.totals.render_seconds = entry.elapsed(now);
  put_film(facts, film);
  return facts;
}

namespace {

// Returns a random job id of 32 bits; if `wide`, of 64 bits. 64 bits avoid collisions in a store where other
// coordinators make ids independently.
JobId random_job_id(bool wide) {
  std::random_device device;
  return {wide ? fmt::format("j-{:08x}{:08x}", device(), device()) : fmt::format("j-{:08x}", device())};
}

Error no_such_job(const JobId& id) { return {Errc::not_found, fmt::format("there is no job {}", id.value)}; }

}  // namespace

EntryPtr JobTable::find(const JobId& id) const {
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : found->second;
}

Sequence* JobTable::sequence(const JobId& id) {
  const auto found = sequences_.find(id);
  return found == sequences_.end() ? nullptr : &found->second;
}

const Sequence* JobTable::sequence(const JobId& id) const {
  const auto found = sequences_.find(id);
  return found == sequences_.end() ? nullptr : &found->second;
}

std::vector<EntryPtr> JobTable::waiting_for(const JobId& id) const {
  std::vector<EntryPtr> all;
  if (const auto found = waiting_.find(id); found != waiting_.end())
    for (const JobId& job : found->second) all.push_back(jobs_.at(job));
  return all;
}

void JobTable::set_after(JobEntry& entry, std::vector<std::string> after) {
  for (const std::string& name : entry.stored.spec.after) {
    const auto found = waiting_.find({name});
    if (found == waiting_.end()) continue;
    found->second.erase(entry.stored.id);
    if (found->second.empty()) waiting_.erase(found);
  }
  entry.stored.spec.after = std::move(after);
  for (const std::string& name : entry.stored.spec.after) waiting_[{name}].insert(entry.stored.id);
}

Result<EntryPtr> JobTable::job(const JobId& id) const {
  if (auto entry = find(id)) return entry;
  const auto frame = frame_of(id);
  const auto sequence = sequences_.find(frame ? frame->sequence : id);
  if (sequence == sequences_.end()) return tl::unexpected(no_such_job(id));
  const std::string frames = to_string(sequence->second.range());
  if (frame)
    return fail(Errc::not_found, fmt::format("job {} has no frame {}: its frames are {}",
                                             frame->sequence.value, frame->frame, frames));
  return fail(Errc::invalid_argument,
              fmt::format("job {} is a sequence: say which of its frames {} is meant", id.value, frames));
}

Result<EntryPtr> JobTable::usable(const JobId& id) const {
  auto entry = job(id);
  if (entry && !(*entry)->broken.empty()) return fail(Errc::failed_precondition, (*entry)->broken);
  return entry;
}

Result<std::vector<EntryPtr>> JobTable::job_or_frames(const JobId& id) const {
  if (const auto sequence = sequences_.find(id); sequence != sequences_.end()) return sequence->second.frames;
  const auto entry = job(id);
  if (!entry) return tl::unexpected(entry.error());
  return std::vector<EntryPtr>{*entry};
}

Result<std::string> JobTable::owner(const JobId& id) const {
  if (const auto entry = find(id)) return entry->stored.owner;
  // The id may name a frame that does not exist, of a sequence that does. Then the sequence's owner is
  // returned, so that this user, who may see the sequence, later gets an error that lists its frames.
  const auto frame = frame_of(id);
  const auto sequence = sequences_.find(frame ? frame->sequence : id);
  if (sequence != sequences_.end()) return sequence->second.frames.front()->stored.owner;
  return tl::unexpected(no_such_job(id));
}

JobId JobTable::unused_id() const {
  JobId id = random_job_id(shared_);
  while (jobs_.contains(id) || sequences_.contains(id)) id = random_job_id(shared_);
  return id;
}

// Checks the limit on all jobs and the limit on the jobs of `owner` (if not empty). The limit per user is the
// lower one, so that no single user can use up the room of all.
Result<void> JobTable::room_for(const std::string& owner, std::size_t jobs) const {
  if (jobs_.size() + jobs > limits::kMaxJobs)
    return fail(Errc::resource_exhausted,
                fmt::format("{} jobs are kept already, and {} more are more than {}", jobs_.size(), jobs,
                            limits::kMaxJobs));
  if (owner.empty()) return {};
  const auto own = static_cast<std::size_t>(std::count_if(
      jobs_.begin(), jobs_.end(), [&](const auto& job) { return job.second->stored.owner == owner; }));
  if (own + jobs <= limits::kMaxJobsOfUser) return {};
  return fail(
      Errc::resource_exhausted,
      fmt::format(
          "{} jobs of user {} are kept already, and {} more are more than {}: remove some that are done", own,
          owner, jobs, limits::kMaxJobsOfUser));
}

Result<void> JobTable::film_room_for(std::span<const StoredJob> more, std::uint64_t in_all) const {
  const std::string& owner = more.front().owner;
  std::uint64_t all = 0, own = 0;
  for (const JobId& id : order_) {
    const auto frames = sequences_.find(id);
    std::vector<std::uint64_t> films;
    const auto count = [&films](const EntryPtr& entry) {
      if (entry->assembly) films.push_back(entry->film_bytes);
    };
    const EntryPtr first = frames == sequences_.end() ? find(id) : frames->second.frames.front();
    if (frames == sequences_.end()) {
      count(first);
    } else {
      std::ranges::for_each(frames->second.frames, count);
    }
    const std::uint64_t bytes = sum_of_largest(std::move(films));
    all += bytes;
    if (first->stored.owner == owner) own += bytes;
  }
  std::vector<std::uint64_t> films;
  for (const StoredJob& job : more) films.push_back(film_bytes_of(job));
  const std::uint64_t bytes = sum_of_largest(std::move(films));
  const auto refuse = [&](std::string_view whose, std::uint64_t held, std::uint64_t most) {
    return fail(
        Errc::resource_exhausted,
        fmt::format("the image takes {:.2f} GB of the coordinator's memory; {} that are not done hold "
                    "{:.2f} of {:.2f} GB: wait until some are done or cancel them, or render a "
                    "smaller image (operators: --film-memory)",
                    gigabytes(bytes), whose, gigabytes(held), gigabytes(most)));
  };
  if (!owner.empty() && bytes > in_all / 2 - std::min(own, in_all / 2))
    return refuse(fmt::format("the jobs of user {}", owner), own, in_all / 2);
  if (bytes > in_all - std::min(all, in_all)) return refuse("all jobs", all, in_all);
  return {};
}

void JobTable::add(const EntryPtr& entry) {
  const JobId& id = entry->stored.id;
  jobs_.emplace(id, entry);
  set_after(*entry, entry->stored.spec.after);
  const auto frame = frame_of(id);
  if (!frame) return order_.push_back(id);
  auto [found, fresh] = sequences_.try_emplace(frame->sequence);
  if (fresh) order_.push_back(frame->sequence);
  auto& frames = found->second.frames;
  const auto place = std::upper_bound(
      frames.begin(), frames.end(), frame->frame,
      [](std::uint32_t number, const EntryPtr& e) { return number < frame_of(e->stored.id)->frame; });
  frames.insert(place, entry);
  entry->in_sequence.counted = entry->stored.state;
  ++found->second.in_state[static_cast<std::size_t>(entry->in_sequence.counted)];
  auto& warnings = found->second.warnings;
  for (const std::string& warning : entry->stored.warnings)
    if (warnings.size() < limits::kMaxWarnings &&
        std::find(warnings.begin(), warnings.end(), warning) == warnings.end())
      warnings.push_back(warning);
}

void JobTable::count_state(JobEntry& entry) {
  const auto frame = frame_of(entry.stored.id);
  Sequence* all =
      frame && entry.in_sequence.counted != entry.stored.state ? sequence(frame->sequence) : nullptr;
  if (!all) return;
  --all->in_state[static_cast<std::size_t>(entry.in_sequence.counted)];
  entry.in_sequence.counted = entry.stored.state;
  ++all->in_state[static_cast<std::size_t>(entry.in_sequence.counted)];
  // If the sequence goes on, its next end is news again
  if (const JobState state = all->for_others(); !is_terminal(state)) all->notified = state;
}

void JobTable::unlist(const JobId& id) {
  sequences_.erase(id);
  std::erase(order_, id);
}

std::optional<JobId> JobTable::remove(const EntryPtr& entry) {
  JobId listed = entry->stored.id;
  set_after(*entry, {});
  jobs_.erase(listed);
  if (const auto frame = frame_of(listed)) {
    listed = frame->sequence;
    const auto found = sequences_.find(listed);
    if (found == sequences_.end()) return std::nullopt;
    if (std::erase(found->second.frames, entry) > 0)
      --found->second.in_state[static_cast<std::size_t>(entry->in_sequence.counted)];
    if (!found->second.frames.empty()) return std::nullopt;
  }
  unlist(listed);
  return listed;
}

}  // namespace ls::coordinator
