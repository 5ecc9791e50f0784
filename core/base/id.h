// Typed identifiers, so that a job cannot be passed in place of a worker.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <string>

namespace ls {

// A short printable name such as "j-7f3a91c2". It is made by the coordinator and unique within its data
// folder.
template <class Tag>
struct Id {
  std::string value;
  bool empty() const { return value.empty(); }
  auto operator<=>(const Id&) const = default;
};

using JobId = Id<struct JobTag>;
using WorkerId = Id<struct WorkerTag>;
using LeaseId = Id<struct LeaseTag>;

}  // namespace ls

template <class Tag>
struct std::hash<ls::Id<Tag>> {
  std::size_t operator()(const ls::Id<Tag>& id) const noexcept { return std::hash<std::string>{}(id.value); }
};
