// Keeps the notifications that receivers have not accepted yet on disk, so that a coordinator that is killed
// sends them after its next start.
//
//   DIR/open/JOB               exists while no notification of the job's end has been stored
//   DIR/RECEIVER/NUMBER.json   a delivery (one notification to one receiver) that is not accepted yet;
//                              RECEIVER is named after the receiver's address
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/base/id.h"
#include "coordinator/webhooks/line.h"

namespace ls::coordinator::webhooks {

class Outbox {
 public:
  static Result<Outbox> open(std::filesystem::path folder, const std::vector<std::string>& urls);

  // Returns the stored deliveries to a receiver, given by its index in `urls`, ascending by number. Files
  // that hold no delivery are neither returned nor removed.
  std::vector<Delivery> waiting(std::size_t receiver) const;
  Result<void> keep(std::size_t receiver, const Delivery& delivery);
  void forget(std::size_t receiver, const Delivery& delivery);

  std::set<JobId> open_jobs() const;
  Result<void> job_is_open(const JobId& job);
  void job_has_ended(const JobId& job);

 private:
  explicit Outbox(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path file(std::size_t receiver, const Delivery& delivery) const;
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> receivers_;
};

}  // namespace ls::coordinator::webhooks
