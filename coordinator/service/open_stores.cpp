#include "coordinator/service/open_stores.h"

#include <fmt/format.h>

#include <random>

#include "coordinator/store/blobs/disk_blobs.h"
#include "coordinator/store/blobs/s3_blobs.h"
#include "coordinator/store/files.h"
#include "coordinator/store/redis/redis_job_store.h"

namespace ls::coordinator {
namespace {
constexpr std::size_t kNodeIdLength = 16;
bool is_s3(const std::string& where) { return where.starts_with("s3:"); }
}  // namespace

Result<void> check_store(const std::string& store) {
  if (store == "sqlite") return {};
  if (!store.starts_with("redis"))
    return fail(Errc::invalid_argument,
                fmt::format("--store '{}' is unknown; use sqlite, or redis://HOST:PORT/DB", store));
  const auto address = parse_redis_url(store);
  return address ? Result<void>() : tl::unexpected(address.error());
}

Result<std::unique_ptr<JobStore>> open_jobs(const std::string& store, const std::filesystem::path& data,
                                            bool shared, const std::string& node) {
  if (auto known = check_store(store); !known) return tl::unexpected(known.error());
  auto local = open_sqlite_job_store(data / "jobs.sqlite");
  if (!local || store == "sqlite") return local;
  RedisStoreOptions redis{.address = *parse_redis_url(store)};
  if (shared) redis.node = node;
  return open_redis_job_store(std::move(*local), std::move(redis));
}

Result<void> check_blobs(const std::string& where) {
  if (!is_s3(where)) return {};
  if (auto address = parse_s3_url(where); !address) return tl::unexpected(address.error());
  if (auto keys = s3_keys_from_environment(); !keys) return tl::unexpected(keys.error());
  return {};
}

Result<std::shared_ptr<BlobStore>> open_blobs(const std::string& where, const std::filesystem::path& data,
                                              const std::string& node) {
  if (is_s3(where)) {
    auto address = parse_s3_url(where);
    if (!address) return tl::unexpected(address.error());
    auto keys = s3_keys_from_environment();
    if (!keys) return tl::unexpected(keys.error());
    return S3Blobs::open({std::move(*address), std::move(*keys)}, data / "blobs");
  }
  if (where.empty()) return DiskBlobs::open(data / "blobs");
  return DiskBlobs::open(where, std::filesystem::path(where) / ("node-" + node));
}

Result<std::string> node_id(const std::filesystem::path& data) {
  const auto path = data / "node-id";
  const auto known = read_file(path, kNodeIdLength);
  if (known) {
    std::string id(reinterpret_cast<const char*>(known->data()), known->size());
    if (id.size() == kNodeIdLength && id.find_first_not_of("0123456789abcdef") == std::string::npos)
      return id;
    return fail(Errc::internal, fmt::format("{} is damaged; remove it", path.string()));
  }
  if (known.error().code != Errc::not_found) return tl::unexpected(known.error());
  std::random_device device;
  const std::string id = fmt::format("{:08x}{:08x}", device(), device());
  if (auto made = write_atomically(path, std::as_bytes(std::span(id))); !made)
    return tl::unexpected(made.error());
  return id;
}

}  // namespace ls::coordinator
