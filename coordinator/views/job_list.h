// A page of the list of jobs: the client's request, and the answer.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/views/job_view.h"

namespace ls::coordinator {

// `order`: order of submission. `active`: running jobs first, then paused, queued and ended ones; among
// equals the newest first.
enum class JobOrder { order, active, submitted, name, owner, state, progress, relmse };
inline constexpr std::array<std::string_view, 8> kJobOrders = {"order", "active", "submitted", "name",
                                                               "owner", "state",  "progress",  "relmse"};

struct JobsAsked {
  // True for owners whose jobs the client may see; empty: all owners
  std::function<bool(const std::string& owner)> visible;
  std::set<JobState> states;  // states to list; empty: all
  std::optional<std::string> owner;
  std::string search;     // part of the name or the id, in upper or lower case
  double since_unix = 0;  // lists only jobs submitted at this time or later
  JobOrder by = JobOrder::order;
  bool descending = false;
  std::size_t offset = 0, limit = std::numeric_limits<std::size_t>::max();
};

struct JobsPage {
  std::vector<JobView> jobs;
  std::size_t total = 0;                // number of jobs that match the request; `jobs` is one page of them
  std::array<std::size_t, 6> states{};  // number of visible jobs in each JobState, whether or not they match
  std::set<std::string> owners;         // owners of all visible jobs
};

}  // namespace ls::coordinator
