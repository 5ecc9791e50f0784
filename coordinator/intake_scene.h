// The scene of a submission, read with the request's assets as its only files.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/scene/read.h"
#include "coordinator/service.h"

namespace ls::coordinator {

struct UploadedScene {
  Scene scene;
  std::vector<Diagnostic> warnings;
  std::size_t text_bytes = 0;     // of included scene files
  std::set<Digest> not_uploaded;  // files that were named, but whose bytes are not here
};

// Files may be missing whose bytes nobody will ask for: who looks at the scene decides. `strict`: a file
// whose bytes are not here is an error, with its place.
tl::expected<UploadedScene, Rejected> read_uploaded(const SubmitRequest& request, const BlobStore& blobs,
                                                    std::optional<std::uint32_t> frame, bool strict);

}  // namespace ls::coordinator
