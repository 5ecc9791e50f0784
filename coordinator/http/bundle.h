// A scene with all its files in one archive: what may be in it, which of it is the scene, and how its files
// get into the blob store. It is looked through as a whole first, so that of an archive that is refused
// nothing is stored.
#pragma once

#include <cstdint>
#include <map>
#include <stop_token>
#include <string>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "coordinator/http/archive.h"
#include "coordinator/service.h"

namespace ls::http {

struct BundleLimits {
  std::uint64_t entry_bytes = std::uint64_t{64} << 30;  // of one file, unpacked
  std::uint64_t total_bytes = std::uint64_t{64} << 30;  // of all of them
};

struct Bundle {
  std::string scene;  // its name in the archive, for messages
  Digest scene_digest;
  // All other files by the names by which the scene reaches them: relative to the scene's own folder.
  std::map<std::string, Digest> assets;
  std::string spec = "{}";  // JSON: what job.json says besides the scene
};

// The scene is the file that job.json names ({"scene": FILE, and the keys of the spec}), else the only .xml
// at the top. If everything lies in one folder, that is the top. Names are normalised ("./a//b" is "a/b").
// Refused, naming the entry, are: names that are absolute, lead out by "..", are no UTF-8, have control
// characters or backslashes; links and devices; a name twice; encrypted entries and unusual packing; more
// entries or bytes than allowed; archives that unpack to more than kBundleSlack + kMaxBundleRatio times their
// own size; what is damaged or cut off. invalid_argument for all of these; else the store's error, or
// `unavailable` after a stop.
Result<Bundle> read_bundle(int fd, std::uint64_t archive_bytes, ArchiveKind kind, const BundleLimits& limits,
                           coordinator::BlobStore& blobs, const std::stop_token& stop);

// An entry's name as all further steps see it; empty: the top folder itself. The error says what is wrong
// with it.
Result<std::string> normal_name(std::string_view name);

}  // namespace ls::http
