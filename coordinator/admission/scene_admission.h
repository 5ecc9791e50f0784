// Reads the scene of a submission, with the request's assets as its only files.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/scene/read.h"
#include "coordinator/store/blobs/blob_store.h"
#include "coordinator/views/submit_request.h"

namespace ls::coordinator {

struct UploadedScene {
  Scene scene;
  std::vector<Diagnostic> warnings;
  std::size_t text_bytes = 0;     // of included scene files
  std::set<Digest> not_uploaded;  // files that the scene names but whose bytes are missing
};

// Missing bytes are no error if not `strict`: the caller decides whether they are needed. `strict`: a missing
// file is an error, with its place in the scene.
tl::expected<UploadedScene, Rejected> read_uploaded(const SubmitRequest& request, const BlobStore& blobs,
                                                    std::optional<std::uint32_t> frame, bool strict);

}  // namespace ls::coordinator
