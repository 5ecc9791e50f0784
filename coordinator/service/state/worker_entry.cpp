#include "coordinator/service/state/worker_entry.h"

#include <charconv>

namespace ls::coordinator {
namespace {

// Returns n of a lease id "PREFIX-n"; nullopt if the lease is of another start of the coordinator.
std::optional<std::uint64_t> lease_number(const LeaseId& id, const std::string& prefix) {
  const std::size_t dash = prefix.size();
  if (!id.value.starts_with(prefix) || id.value.size() <= dash || id.value[dash] != '-') return std::nullopt;
  std::uint64_t n = 0;
  const char* end = id.value.data() + id.value.size();
  const auto parsed = std::from_chars(id.value.data() + dash + 1, end, n);
  return parsed.ec == std::errc() && parsed.ptr == end ? std::optional(n) : std::nullopt;
}

}  // namespace

Connection::Connection(WorkerId id, std::uint64_t number, const WorkerHello& hello,
                       std::shared_ptr<WorkerSink> to, std::string prefix)
    : worker(std::move(id)),
      epoch(number),
      numeric_class(hello.numeric_class),
      fake(hello.fake),
      sink(std::move(to)),
      lease_prefix_(std::move(prefix)) {}

void Connection::close() {
  if (!std::exchange(open, false)) return;
  sink->close();
}

void Connection::note_lease(const LeaseId& lease) {
  if (!first_lease_) first_lease_ = lease_number(lease, lease_prefix_);
}

bool Connection::assigned(const LeaseId& lease) const {
  const auto n = lease_number(lease, lease_prefix_);
  return n && first_lease_ && *n >= *first_lease_;
}

}  // namespace ls::coordinator
