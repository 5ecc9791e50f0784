// Reads the scene of a submission, with the request's assets as its only files.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/scene/read.h"
#include "coordinator/store/blobs/blob_store.h"
#include "coordinator/views/job_view.h"

namespace ls::coordinator {

struct UploadedScene {
  Scene scene;
  std::vector<Diagnostic> warnings;
  std::size_t text_bytes = 0;     // bytes of the scene files that the main file includes
  std::set<Digest> not_uploaded;  // files that the scene names but that are not in the store
};

// Reads the request's scene. `strict`: a file that is not in the store is an error, with its place in the
// scene. Otherwise it is listed in not_uploaded, and the caller decides whether it is needed. A scene file
// that the scene includes must be in the store in any case.
tl::expected<UploadedScene, Rejected> read_uploaded(const SubmitRequest& request, const BlobStore& blobs,
                                                    std::optional<std::uint32_t> frame, bool strict);

}  // namespace ls::coordinator
