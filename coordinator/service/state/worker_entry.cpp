#include "coordinator/service/state/worker_entry.h"

#include "common/base/parse_number.h"

namespace ls::coordinator {
namespace {

// Returns n of a lease id "PREFIX-n"; nullopt if it has another prefix, that of an earlier start of the
// coordinator.
std::optional<std::uint64_t> lease_number(const LeaseId& id, const std::string& prefix) {
  const std::size_t dash = prefix.size();
  if (!id.value.starts_with(prefix) || id.value.size() <= dash || id.value[dash] != '-') return std::nullopt;
  return parse_number<std::uint64_t>(std::string_view(id.value).substr(dash + 1));
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
