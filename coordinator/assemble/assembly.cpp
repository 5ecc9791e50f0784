#include "coordinator/assemble/assembly.h"

#include "coordinator/base/limits.h"

namespace ls::coordinator {
namespace {
std::size_t bytes_of(const WaitingPartial& w) {
  return w.partial ? w.partial->sums.size() * sizeof(float) : 0;
}
}  // namespace

void Assembly::hold(TileIndex tile, RoundIndex round, WaitingPartial waiting) {
  if (waiting.place && WaitingBytes::all() + bytes_of(waiting) > limits::kMaxPendingPartials)
    waiting.partial.reset();
  waiting_bytes_.add(bytes_of(waiting));
  auto& slot = waiting_[{tile, round}];
  waiting_bytes_.remove(bytes_of(slot));
  slot = std::move(waiting);
}

std::optional<WaitingPartial> Assembly::take(TileIndex tile, RoundIndex round, SampleRange samples) {
  const auto found = waiting_.find({tile, round});
  if (found == waiting_.end() || found->second.samples != samples) return std::nullopt;
  std::optional<WaitingPartial> taken(std::move(found->second));
  waiting_.erase(found);
  waiting_bytes_.remove(bytes_of(*taken));
  return taken;
}

void Assembly::forget_round(RoundIndex round) {
  std::erase_if(waiting_, [&](const auto& entry) {
    if (entry.first.second != round) return false;
    waiting_bytes_.remove(bytes_of(entry.second));
    return true;
  });
}

void Assembly::discard(TileIndex tile) {
  std::erase_if(waiting_, [&](const auto& entry) {
    if (entry.first.first != tile) return false;
    waiting_bytes_.remove(bytes_of(entry.second));
    return true;
  });
  film_.discard(tile);
  errors_.discard(tile);
  health_.discard(tile);
}

void Assembly::forget_waiting() {
  waiting_.clear();
  waiting_bytes_ = WaitingBytes();
}

Result<TileError> Assembly::fold(TileIndex tile, RoundIndex round, const WaitingPartial& waiting) {
  const auto error = film_.fold(tile, round, *waiting.partial, waiting.digest);
  if (!error) return error;
  errors_.folded(tile, round, *error);
  health_.folded(tile, round, waiting.samples, waiting.health);
  ++folds_since_snapshot;
  return error;
}

std::vector<RoundIndex> Assembly::rounds_for(std::uint64_t spp) const {
  std::vector<RoundIndex> rounds(film_.grid().count());
  for (TileIndex t = 0; t < rounds.size(); ++t) {
    const auto tail = film_.tail(t);
    const RoundIndex full = film_.full_rounds(t);
    rounds[t] = tail && *tail == cut_range(full, spp) ? full + 1 : full;
  }
  return rounds;
}

}  // namespace ls::coordinator
