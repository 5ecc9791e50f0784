// Which jobs' briefs (JobBrief) a worker remembers. The coordinator sends a brief only if the worker does not
// remember it, so both sides must agree about that at any time. They agree because each keeps a BriefMemory
// of the same size for the stream, and updates it with every lease in the order in which the stream carries
// the leases. (HTTP/2 keeps the header tables of its two ends equal in the same way: RFC 7541.)
#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <optional>

#include "util/protocol/messages.h"

namespace ls {

// Memory for briefs that a worker offers (WorkerHello::brief_bytes), in bytes: thousands of usual briefs, or
// five of the largest
inline constexpr std::size_t kBriefBytes = 4 << 20;

// Returns how many bytes of a BriefMemory a brief takes: its texts, and a fixed amount for everything else.
std::size_t memory_of(const JobBrief& brief);

// The jobs whose briefs are remembered. `Job` is the type that identifies a job.
template <class Job>
class BriefMemory {
 public:
  explicit BriefMemory(std::size_t bytes = 0) : most_(bytes) {}

  bool has(const Job& job) const {
    const auto found = places_.find(job);
    return found != places_.end() && !found->second->doubtful;
  }
  // Notes a lease of the job. `brief_bytes`: memory_of() the brief that comes with it; nullopt: none comes.
  // While the memory is too small for all briefs, the job whose last lease is the oldest is forgotten. (A
  // brief that is larger than the memory is forgotten at once.)
  void leased(const Job& job, std::optional<std::size_t> brief_bytes) {
    const auto found = places_.find(job);
    if (found != places_.end()) {
      order_.splice(order_.begin(), order_, found->second);
    } else if (brief_bytes) {
      order_.push_front({job});
      places_.emplace(job, order_.begin());
    }
    if (brief_bytes) {
      used_ += *brief_bytes - order_.front().bytes;
      order_.front() = {job, *brief_bytes};
    }
    while (used_ > most_) {
      used_ -= order_.back().bytes;
      places_.erase(order_.back().job);
      order_.pop_back();
    }
  }
  // Makes has() false until the next lease with a brief. For the coordinator, when a worker returns a lease:
  // it may not know the job. The brief keeps its place, as it may have one in the worker's memory.
  void doubt(const Job& job) {
    if (const auto found = places_.find(job); found != places_.end()) found->second->doubtful = true;
  }
  std::size_t size() const { return order_.size(); }
  void clear() { *this = BriefMemory(most_); }

 private:
  struct Entry {
    Job job;
    std::size_t bytes = 0;
    bool doubtful = false;
  };
  std::size_t most_ = 0, used_ = 0;
  std::list<Entry> order_;  // latest lease first
  std::map<Job, typename std::list<Entry>::iterator> places_;
};

}  // namespace ls
