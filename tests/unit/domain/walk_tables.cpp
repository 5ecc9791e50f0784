// How a walk records the farm's effects, and compares its records with the farm's.
#include "core/base/overloaded.h"
#include "tests/unit/domain/stop_oracle.h"
#include "tests/unit/domain/walk.h"

namespace ls::coordinator {

void Walk::see(const Effect& effect) {
  std::visit(overloaded{[&](const Send& e) { see(e); },
                        [&](const RecordUnit& e) {
                          auto& accepted = jobs_[e.unit.job].accepted;
                          const bool once = accepted.try_emplace({e.unit.tile, e.unit.round}, e).second;
                          if (!once && accepted[{e.unit.tile, e.unit.round}].samples == e.samples) {
                            // After a job has stopped, accepted results beyond its end are forgotten; an
                            // extension may accept these units again.
                            if (!jobs_[e.unit.job].disturbed && !jobs_[e.unit.job].reopened)
                              blame("a unit was accepted twice");
                          }
                          accepted[{e.unit.tile, e.unit.round}] = e;
                        },
                        [&](const Fold& e) { see_fold(e); },
                        [&](const ReopenRound& e) {
                          StoredJob& job = jobs_[e.job];
                          for (TileIndex t = 0; t < job.fold_asked.size(); ++t) {
                            job.fold_asked[t] = std::min(job.fold_asked[t], e.round);
                            job.folded[t] = std::min(job.folded[t], e.round);
                            job.accepted.erase({t, e.round});
                            job.film[t].resize(std::min<std::size_t>(job.film[t].size(), e.round));
                          }
                          job.done_seen = 0;
                        },
                        [&](const JobFinished& e) { see_end(e.job, e.stopped); },
                        [&](const DigestMismatch&) {
                          if (faulty_.empty()) blame("a mismatch without a liar");
                        },
                        [&](const WorkerFoundFaulty& e) { see_faulty_worker(e); },
                        [&](const TileDiscarded& e) { see_discard(e); }, [](const auto&) {}},
             effect);
}

void Walk::see_faulty_worker(const WorkerFoundFaulty& found) {
  if (found.worker.value != faulty_) blame("an honest worker is quarantined: " + found.evidence);
  found_ = true;
  for (const auto& [id, job] : jobs_)
    if (farm_.job(id)->state == JobState::done) ended_before_.insert(id);
}

void Walk::see_discard(const TileDiscarded& discarded) {
  if (!found_) blame("a tile is void though nobody lied");
  StoredJob& job = jobs_[discarded.job];
  job.discarded = true;
  job.done_seen = 0;
  job.fold_asked[discarded.tile] = job.folded[discarded.tile] = 0;
  job.film[discarded.tile].clear();
  std::erase_if(job.accepted, [&](const auto& a) { return a.first.first == discarded.tile; });
  std::erase_if(unfolded_, [&](const UnitFolded& f) {
    return f.unit.job == discarded.job && f.unit.tile == discarded.tile;
  });
}

// Once the faulty worker is found, none of its pixels are left. Without a faulty worker every unit is right.
void Walk::see_film(const JobId& id) {
  const StoredJob& job = jobs_[id];
  const std::uint64_t spp = farm_.job(id)->spp;
  for (TileIndex t = 0; t < job.film.size(); ++t) {
    if (job.film[t].size() != job.folded[t]) return blame("a tile has another number of rounds than folds");
    for (RoundIndex k = 0; k < job.film[t].size(); ++k) {
      const auto it = job.accepted.find({t, k});
      if (found_ && it != job.accepted.end() && it->second.worker.value == faulty_ &&
          !ended_before_.contains(id))
        blame("something of the quarantined worker's is in an image");
      if (faulty_.empty() && job.film[t][k] != honest({id, t, k}, cut_range(k, spp))) blame("a wrong image");
    }
  }
}

void Walk::see(const Send& sent) {
  FakeWorker& worker = workers_[sent.worker.value];
  if (!worker.connected) blame("a message to a worker that is gone");
  if (found_ && sent.worker.value == faulty_ && std::holds_alternative<AssignLease>(sent.message))
    blame("work for a quarantined worker");
  std::visit(overloaded{[&](const AssignLease& m) {
                          if (m.lease.units.empty()) blame("an empty lease");
                          for (const LeaseUnit& u : m.lease.units)
                            worker.held.push_back({m.lease.job, m.lease.id, u});
                        },
                        [&](const CancelLease& m) {
                          std::erase_if(worker.held, [&](const auto& h) { return h.lease == m.lease; });
                        },
                        [&](const RecallLease& m) { recalled_.emplace_back(sent.worker, m.lease); },
                        [&](const CancelJob& m) {
                          std::erase_if(worker.held, [&](const auto& h) { return h.job == m.job; });
                        },
                        [](const auto&) {}},
             sent.message);
}

void Walk::see_fold(const Fold& fold) {
  StoredJob& job = jobs_[fold.unit.job];
  RoundIndex& asked = job.fold_asked[fold.unit.tile];
  const auto it = job.accepted.find({fold.unit.tile, fold.unit.round});
  if (it == job.accepted.end() || it->second.samples != fold.samples) blame("a fold of what is not accepted");
  if (fold.unit.round != asked) blame("a fold out of order");
  ++asked;
  unfolded_.push_back({fold.unit, fold.samples, error_sum(job, fold.unit.tile, fold.unit.round)});
}

// Returns the error sum of a tile. Each tile has a variance per sample of 2^-3 to 2^3, and every round
// scatters.
double Walk::error_sum(const StoredJob& job, TileIndex tile, RoundIndex round) {
  std::mt19937_64 of_tile(job.errors + tile), of_round(job.errors + 1000003 * round + tile);
  const double variance = std::exp2(static_cast<double>(of_tile() % 7) - 3);
  const double scatter = .75 + static_cast<double>(of_round() % 512) / 1024;
  return scatter * variance / static_cast<double>(round_range(round).s1) * 3 *
         static_cast<double>(job.plan.grid.rect(tile).pixels());
}

void Walk::see_end(const JobId& id, StopReason reason) {
  const StoredJob& job = jobs_[id];
  if (job.folded != job.fold_asked) blame("a job finished before all was folded");
  see_film(id);
  if (job.disturbed || reason == StopReason::time || reason == StopReason::user) return;
  // Where each tile must end, computed from its errors alone.
  const std::uint64_t spp = farm_.job(id)->spp;
  const auto target = farm_.plan(id)->target_error;
  std::vector<RoundIndex> ends(job.folded.size(), round_count(spp));
  if (target) {
    const auto error = [&](TileIndex t, RoundIndex k) { return error_sum(job, t, k); };
    ends = stop_at_once(job.plan.grid, spp, *target, error).ends;
  }
  for (TileIndex t = 0; t < ends.size(); ++t) {
    if (job.folded[t] != ends[t])
      blame("tile " + std::to_string(t) + " of job " + id.value + " ended after " +
            std::to_string(job.folded[t]) + " rounds instead of " + std::to_string(ends[t]) + " (" +
            std::string(to_string(reason)) + ", spp " + std::to_string(spp) + (target ? ", target" : "") +
            (job.plan.time ? ", time" : "") + ")");
  }
}

void Walk::check_figures() {
  for (auto& [id, job] : jobs_) {
    const auto figures = farm_.job(id);
    if (!figures) return blame("a job is gone");
    if (figures->state == JobState::failed || figures->state == JobState::cancelled) continue;
    if (figures->units_done < job.done_seen && !job.disturbed && !job.plan.target_error && !job.plan.time)
      blame("done regressed");
    job.done_seen = figures->units_done;
    if (figures->units_total != figures->units_done + figures->units_leased + figures->units_queued) {
      blame("planned is not done + leased + queued");
    }
  }
}

}  // namespace ls::coordinator
