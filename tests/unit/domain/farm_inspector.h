// What tests read of a farm besides its queries: its invariants, and the state that the product does not
// need.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/domain/fair_share.h"
#include "coordinator/domain/farm/farm.h"

namespace ls::coordinator {

// Checks all invariants and describes the first violation; empty if all hold. Invariants: planned = done +
// leased + queued; leases, workers and jobs agree with one another; no worker is idle while a queued unit
// exists that it may take. May be called only right after Farm::handle().
std::string audit(const Farm& farm);

// Returns the sizes of all containers, by name: they must not grow without bound.
std::vector<std::pair<std::string, std::size_t>> sizes(const Farm& farm);

std::vector<JobId> jobs_of(const Farm& farm);  // in order of submission

struct TileFigures {
  RoundIndex rounds_folded = 0;
  std::uint64_t spp = 0;
};
std::optional<TileFigures> tile_figures(const Farm& farm, const JobId& id, TileIndex tile);

// Returns the core seconds of all users whose jobs have units to lease or leased units.
std::vector<FairShare::Figure> shares(const Farm& farm);

}  // namespace ls::coordinator
