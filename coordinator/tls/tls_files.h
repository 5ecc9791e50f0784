// The coordinator's TLS files: provided by the operator, or created by the coordinator.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/error.h"

namespace ls::tls {

struct Texts {       // PEM
  std::string ca;    // CA that must have signed the workers' certificates
  std::string cert;  // of the coordinator, with its chain
  std::string key;
};

// invalid_argument: a file cannot be read, or others may read the key.
Result<Texts> read_files(const std::filesystem::path& ca, const std::filesystem::path& cert,
                         const std::filesystem::path& key);

// True if a key file with this mode can be read only by `reader`. A file owned by root may also be
// group-readable: that is how secrets are mounted in a cluster.
bool kept_secret(unsigned owner, unsigned mode, unsigned reader);

// Files of a farm with its own authority, in `folder` (0700): ca.pem and ca.key are created once, server.pem
// and server.key at each start, worker.pem and worker.key if they do not exist or expire within 30 days.
// `names`: names of this machine for clients, besides localhost and its host name.
Result<Texts> make_files(const std::filesystem::path& folder, std::vector<std::string> names,
                         std::int64_t now);

}  // namespace ls::tls
