// Opens the stores that the options --store and --blobs name.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "coordinator/store/blobs/blob_store.h"
#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {

// Checks the value of --store: sqlite, or a redis:// address.
Result<void> check_store(const std::string& store);

// Opens the job store that `store` names: with `sqlite`, an SQLite file in the folder `data`; with a redis://
// address, a Redis server together with that file. `shared`: other coordinators use the same Redis server;
// `node` is this coordinator's name among them.
Result<std::unique_ptr<JobStore>> open_jobs(const std::string& store, const std::filesystem::path& data,
                                            bool shared, const std::string& node);

// Checks the value of --blobs: a folder, or an s3:// address with keys in the environment.
Result<void> check_blobs(const std::string& where);

// Opens the blob store that `where` names. If `where` is empty, blobs are kept in the folder `data`/blobs. If
// it is an s3:// address, they are kept in that bucket, and `data`/blobs contains the ones that are being
// uploaded or downloaded (s3_blobs.h). Any other `where` names a folder that several coordinators may share;
// `node` is this coordinator's name among them.
Result<std::shared_ptr<BlobStore>> open_blobs(const std::string& where, const std::filesystem::path& data,
                                              const std::string& node);

// Returns this coordinator's permanent name: a random text in DATA/node-id (DATA is `data`), created at the
// first start.
Result<std::string> node_id(const std::filesystem::path& data);

}  // namespace ls::coordinator
