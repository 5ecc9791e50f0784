// Facts about a farm for `lightshaft doctor`, read from the coordinator's HTTP interface by GET requests
// only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/farm/http_client.h"

namespace ls::cli {

struct WorkerFacts {
  std::string name, state, activity, version, numeric_class;
  bool fake = false;
};

struct FarmFacts {
  std::string url;  // address without user and password
  bool has_token = false;
  std::string trouble;            // why there was no answer; empty: there was an answer
  bool is_coordinator = false;    // true if a coordinator answered
  std::string not_ready, remark;  // from /readyz: why the coordinator cannot take jobs; another remark
  // In seconds since 1970: this machine's clock before and after the request, and the coordinator's clock,
  // from the header Date of its answer.
  double asked_at = 0, answered_at = 0;
  std::optional<std::int64_t> date;
  int session_status = 0;  // HTTP status of GET /api/v1/session, which returns the token's role
  std::string session_trouble, role, user, version;
  std::optional<std::vector<WorkerFacts>> workers;
};

// Returns one result for each address of `connection`. invalid_argument: an address or the CA file cannot be
// used.
Result<std::vector<FarmFacts>> observe_farm(const HttpClient::Options& connection);

}  // namespace ls::cli
