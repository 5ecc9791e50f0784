// A bundle is a scene with all its files in one archive. read_bundle() checks what the archive contains,
// decides which file is the scene, and stores the files as blobs. It checks the whole archive before it
// stores the first file, so that nothing of a rejected archive is stored.
#pragma once

#include <cstdint>
#include <map>
#include <stop_token>
#include <string>
#include <string_view>

#include "coordinator/http/bundle/archive.h"
#include "coordinator/store/blobs/blob_store.h"
#include "coordinator/views/views.h"
#include "core/base/digest.h"
#include "core/base/error.h"

namespace ls::http {

struct BundleLimits {
  std::uint64_t entry_bytes = std::uint64_t{64} << 30;  // greatest unpacked size of one file
  std::uint64_t total_bytes = std::uint64_t{64} << 30;  // greatest unpacked size of all files together
};

struct Bundle {
  std::string scene;  // the scene file's name in the archive, for messages
  Digest scene_digest;
  // All other files by the names that the scene uses: relative to the scene's folder.
  std::map<std::string, Digest> assets;
  std::string spec = "{}";  // job spec in JSON: the keys of job.json except the scene
};

// Reads the archive of `archive_bytes` bytes in `fd`. The scene is the file that job.json names ({"scene":
// FILE, and the keys of the spec}); without a job.json it is the only .xml file at the top or, if there is
// none, the only stage of USD there. If all files are in one folder, that folder is the top. Names are
// normalised ("./a//b" is "a/b").
//
// An archive is rejected for the following reasons, and the message names the entry: names that are absolute,
// lead out of the archive by "..", are not UTF-8, or have control characters or backslashes; links and
// devices; duplicate names; encrypted entries and unusual compression; more entries or bytes than allowed;
// archives that unpack to more than kBundleSlack + kMaxBundleRatio times their own size; damaged or truncated
// archives. These errors are invalid_argument. Other errors are those of the store, and `unavailable` after a
// stop.
Result<Bundle> read_bundle(int fd, std::uint64_t archive_bytes, ArchiveKind kind, const BundleLimits& limits,
                           coordinator::BlobStore& blobs, const std::stop_token& stop);

// Returns the normalised name of an entry; an empty name is the top folder itself. The error explains why a
// name is rejected.
Result<std::string> normal_name(std::string_view name);

}  // namespace ls::http
