// Opens the blob store that --blobs names.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "coordinator/store/blobs/blob_store.h"

namespace ls::coordinator {

// Opens the store that `where` names. Empty: the folder `data`/blobs. An s3:// address: that bucket, with
// `data`/blobs for blobs that are being uploaded or downloaded (s3_blobs.h). Otherwise: a folder, which
// several coordinators may share; `node` is the name of this one among them.
Result<std::shared_ptr<BlobStore>> open_blobs(const std::string& where, const std::filesystem::path& data,
                                              const std::string& node);

// The random name in DATA/node-id, created at the first start.
Result<std::string> node_id(const std::filesystem::path& data);

}  // namespace ls::coordinator
