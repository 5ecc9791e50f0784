// The list of jobs that a client asks for.
#include <algorithm>
#include <cctype>
#include <iterator>
#include <sstream>
#include <thread>

#include "coordinator/service/core.h"

namespace ls::coordinator {
namespace {

// Jobs for which the lock is held at once: while a long list is made, others get the lock between two steps.
constexpr std::size_t kStep = 32;

// One job of the list, with the values that the list is filtered and sorted by. A view (JobView) takes time
// to make, so it is made only where needed.
struct Row {
  JobId id;
  std::optional<JobView> view;  // set for a sequence, whose state is combined from its frames
  JobState state = JobState::queued;
  bool held = false;
  std::string name, owner;
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

// Returns the words of a search, in lower case.
std::vector<std::string> words_of(const std::string& search) {
  std::istringstream text(lower(search));
  return {std::istream_iterator<std::string>(text), {}};
}

bool asked_for(const Row& row, const JobsAsked& asked, const std::vector<std::string>& words) {
  const auto has = [text = lower(row.name + '\n' + row.id.value)](const std::string& word) {
    return text.find(word) != std::string::npos;
  };
  const bool any_state = asked.states.empty() && !asked.held;
  return (any_state || asked.states.contains(row.state) || (asked.held && row.held)) &&
         (!asked.owner || *asked.owner == row.owner) && row.submitted >= asked.since_unix &&
         (words.empty() || std::ranges::all_of(words, has));
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
      return lower(a.name) < lower(b.name);
    case JobOrder::owner:
      return a.owner < b.owner;
    case JobOrder::state:
      return a.state < b.state;
    case JobOrder::progress:
      return a.view->progress < b.view->progress;
    case JobOrder::relmse:
      return error_of(a) < error_of(b);
  }
  return false;
}

// Calls `act` with the core and each index below `count`. Others may get the lock after every few of them.
template <class Act>
void step_through(Guarded<Core>& core, std::size_t count, Act act) {
  for (std::size_t begin = 0; begin < count; begin += kStep) {
    {
      const auto locked = core.lock();
      for (std::size_t i = begin; i < std::min(count, begin + kStep); ++i) act(*locked, i);
    }
    std::this_thread::yield();
  }
}

// Returns the view of a job or a sequence; nullopt: it was removed meanwhile.
std::optional<JobView> view_of(Core& core, const JobId& id) {
  if (const Sequence* sequence = core.jobs.sequence(id)) return core.views.sequence(id, *sequence, false);
  const EntryPtr entry = core.jobs.find(id);
  return entry ? std::optional(core.views.job(*entry)) : std::nullopt;
}

// Returns the row of a job that the client may see; nullopt: it may not, or the job was removed meanwhile.
std::optional<Row> row_of(Core& core, const JobId& id, const JobsAsked& asked, bool with_view) {
  const Sequence* sequence = core.jobs.sequence(id);
  const EntryPtr entry = sequence ? sequence->frames.front() : core.jobs.find(id);
  if (!entry || (asked.visible && !asked.visible(entry->stored.owner))) return std::nullopt;
  const StoredJob& job = entry->stored;
  Row row{id,       {},        job.state,         is_held(job.state, !job.spec.after.empty()),
          job.name, job.owner, job.submitted_unix};
  if (sequence || with_view) row.view = view_of(core, id);
  if (row.view) {
    row.state = row.view->state;
    row.held = is_held(row.state, !row.view->after.empty());
  }
  return row;
}

void sort(std::vector<Row>& rows, const JobsAsked& asked) {
  if (asked.by != JobOrder::order)
    std::stable_sort(rows.begin(), rows.end(), [&](const Row& a, const Row& b) {
      return asked.descending ? before(b, a, asked.by) : before(a, b, asked.by);
    });
  else if (asked.descending)
    std::reverse(rows.begin(), rows.end());
}

}  // namespace

JobsPage list_jobs(Guarded<Core>& core, const JobsAsked& asked) {
  JobsPage page;
  std::vector<Row> rows;
  const std::vector<std::string> words = words_of(asked.search);
  const std::vector<JobId> all = core.lock()->jobs.order();
  const bool by_view = asked.by == JobOrder::progress || asked.by == JobOrder::relmse;
  step_through(core, all.size(), [&](Core& locked, std::size_t i) {
    auto row = row_of(locked, all[i], asked, by_view);
    if (!row) return;
    ++page.states[static_cast<std::size_t>(row->state)];
    page.held += row->held;
    page.owners.insert(row->owner);
    if (asked_for(*row, asked, words)) rows.push_back(std::move(*row));
  });
  page.total = rows.size();
  sort(rows, asked);
  const std::size_t first = std::min(asked.offset, rows.size());
  const std::size_t count = std::min(asked.limit, rows.size() - first);
  step_through(core, count, [&](Core& locked, std::size_t i) {
    Row& row = rows[first + i];
    auto view = row.view ? std::move(row.view) : view_of(locked, row.id);
    if (!view) return;
    view->failure.reset();  // `error` says the same; a list of many failed jobs would be twice as long
    page.jobs.push_back(std::move(*view));
  });
  return page;
}

}  // namespace ls::coordinator
