// Where --blobs says that blobs are kept.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "coordinator/service.h"

namespace ls::coordinator {

// Empty: DATA/blobs. s3://...: there, with DATA/blobs for what is on its way (store/s3_blobs.h). Else a
// folder, which other coordinators may share; `node` names this one among them.
Result<std::shared_ptr<BlobStore>> open_blobs(const std::string& where, const std::filesystem::path& data,
                                              const std::string& node);

// A random name in DATA/node-id, made at the first start.
Result<std::string> node_id(const std::filesystem::path& data);

}  // namespace ls::coordinator
