// The coordinator's TLS files: provided by the operator, or created by the coordinator.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace ls::tls {

struct Texts {       // texts in PEM format
  std::string ca;    // CA that must have signed the workers' certificates
  std::string cert;  // the coordinator's certificate with its chain
  std::string key;
};

// Reads the three files. invalid_argument: a file cannot be read, or others may read the key.
Result<Texts> read_files(const std::filesystem::path& ca, const std::filesystem::path& cert,
                         const std::filesystem::path& key);

// True if a key file with this owner and mode can be read only by `reader` (`reader` and `owner` are user
// ids). A file owned by root may also be readable by its group, because clusters mount secrets in this way.
bool kept_secret(unsigned owner, unsigned mode, unsigned reader);

// Makes the TLS files of a farm with its own certificate authority, in `folder` (mode 0700), and returns
// those of the coordinator. The authority's ca.pem and ca.key are created once; server.pem and server.key at
// each start; worker.pem and worker.key if they do not exist or expire within 30 days. `names` are names by
// which clients reach this machine, besides localhost and its host name. `now` is in seconds since 1970.
Result<Texts> make_files(const std::filesystem::path& folder, std::vector<std::string> names,
                         std::int64_t now);

}  // namespace ls::tls
