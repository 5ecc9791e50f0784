// Compresses bodies with gzip for clients that accept it: over slow links the dashboard and long lists of
// jobs arrive several times as fast.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "coordinator/http/message/message.h"

namespace ls::http {

// Returns true if the client accepts bodies that are compressed with gzip.
bool accepts_gzip(const Request& request);
// Returns the bytes in gzip; nullopt: they would not become shorter.
std::optional<std::string> gzipped(std::span<const std::byte> bytes);
// Compresses the body in place, if it is JSON long enough to be worth it and the client accepts gzip.
void compress(Response& response, const Request& request);

}  // namespace ls::http
