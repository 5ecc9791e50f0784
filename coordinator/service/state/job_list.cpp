#include "coordinator/service/state/job_views.h"

#include <algorithm>
#include <cctype>

namespace ls::coordinator {
namespace {

// One job of the list, with the values that the list is filtered and sorted by. A view (JobView) takes time
// to make, so it is made only where needed.
struct Row {
  JobId id;
  const JobEntry* entry = nullptr;
  std::optional<JobView> view;  // set for a sequence, whose state is combined from its frames
  JobState state = JobState::queued;
  const std::string* name = nullptr;
  const std::string* owner = nullptr;
  double submitted = 0;
};

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// Returns the position of jobs in this state in a list ordered by JobOrder::active; 0 comes first.
int rank(JobState state) {
  return state == JobState::running ? 0 : state == JobState::paused ? 1 : state == JobState::queued ? 2 : 3;
}

bool asked_for(const Row& row, const JobsAsked& asked, const std::string& search) {
  return (asked.states.empty() || asked.states.contains(row.state)) &&
         (!asked.owner || *asked.owner == *row.owner) && row.submitted >= asked.since_unix &&
         (search.empty() || lower(*row.name).find(search) != std::string::npos ||
          lower(row.id.value).find(search) != std::string::npos);
}

// Returns the relative mean squared error to sort by; infinity if the job has no error estimate yet.
double error_of(const Row& row) {
  return row.view->error_now ? row.view->error_now->relmse : std::numeric_limits<double>::infinity();
}

bool before(const Row& a, const Row& b, JobOrder by) {
  switch (by) {
    case JobOrder::order:
      return false;
    case JobOrder::active:
      return rank(a.state) != rank(b.state) ? rank(a.state) < rank(b.state) : a.submitted > b.submitted;
    case JobOrder::submitted:
      return a.submitted < b.submitted;
    case JobOrder::name:
      return lower(*a.name) < lower(*b.name);
    case JobOrder::owner:
      return *a.owner < *b.owner;
    case JobOrder::state:
      return a.state < b.state;
    case JobOrder::progress:
      return a.view->progress < b.view->progress;
    case JobOrder::relmse:
      return error_of(a) < error_of(b);
  }
  return false;
}

}  // namespace

JobsPage list_jobs(JobTable& jobs, const JobViews& views, const JobsAsked& asked) {
  JobsPage page;
  std::vector<Row> rows;
  const std::string search = lower(asked.search);
  for (const JobId& id : jobs.order()) {
    Row row;
    row.id = id;
    const Sequence* sequence = jobs.sequence(id);
    row.entry = sequence ? sequence->frames.front().get() : jobs.find(id).get();
    row.owner = &row.entry->stored.owner;
    if (asked.visible && !asked.visible(*row.owner)) continue;
    if (sequence) row.view = views.sequence(id, *sequence, false);
    row.state = row.view ? row.view->state : row.entry->stored.state;
    row.name = &row.entry->stored.name;
    row.submitted = row.entry->stored.submitted_unix;
    ++page.states[static_cast<std::size_t>(row.state)];
    page.owners.insert(*row.owner);
    if (asked_for(row, asked, search)) rows.push_back(std::move(row));
  }
  page.total = rows.size();
  if (asked.by == JobOrder::progress || asked.by == JobOrder::relmse)
    for (Row& row : rows)
      if (!row.view) row.view = views.job(*row.entry);
  if (asked.by != JobOrder::order)
    std::stable_sort(rows.begin(), rows.end(), [&](const Row& a, const Row& b) {
      return asked.descending ? before(b, a, asked.by) : before(a, b, asked.by);
    });
  else if (asked.descending)
    std::reverse(rows.begin(), rows.end());
  const std::size_t first = std::min(asked.offset, rows.size());
  const std::size_t last = first + std::min(asked.limit, rows.size() - first);
  for (std::size_t i = first; i < last; ++i)
    page.jobs.push_back(rows[i].view ? std::move(*rows[i].view) : views.job(*rows[i].entry));
  return page;
}

}  // namespace ls::coordinator
