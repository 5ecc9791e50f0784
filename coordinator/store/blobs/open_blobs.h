// Opens the blob store that --blobs names.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "coordinator/store/blobs/blob_store.h"

namespace ls::coordinator {

// Empty: DATA/blobs. s3://...: that store, with DATA/blobs for blobs in transit (store/blobs/s3_blobs.h).
// Otherwise a folder, which other coordinators may share; `node` is the name of this one.
Result<std::shared_ptr<BlobStore>> open_blobs(const std::string& where, const std::filesystem::path& data,
                                              const std::string& node);

// The random name in DATA/node-id, created at the first start.
Result<std::string> node_id(const std::filesystem::path& data);

}  // namespace ls::coordinator
