// What a coordinator speaks TLS with: certificates that the operator brings, or those it makes itself.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/error.h"

namespace ls::tls {

struct Texts {       // PEM
  std::string ca;    // whose certificates workers must show
  std::string cert;  // the coordinator's, with its chain
  std::string key;
};

// invalid_argument: a file cannot be read, or others may read the key.
Result<Texts> read_files(const std::filesystem::path& ca, const std::filesystem::path& cert,
                         const std::filesystem::path& key);

// Whether the mode of a key's file lets nobody read it but `reader`. What root owns it may be shown through
// its group: so secrets are mounted in a cluster.
bool kept_secret(unsigned owner, unsigned mode, unsigned reader);

// Of a farm with an authority of its own, in `folder` (0700): ca.pem and ca.key are made once, server.pem and
// server.key anew at each start, worker.pem and worker.key when there are none or they end within 30 days.
// `names`: what clients call this machine, besides localhost and its host name.
Result<Texts> make_files(const std::filesystem::path& folder, std::vector<std::string> names,
                         std::int64_t now);

}  // namespace ls::tls
