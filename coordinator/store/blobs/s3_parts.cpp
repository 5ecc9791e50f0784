// Sends a large file as one object in parts: the store checks each part's digest, and each is retried
// separately.
#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>

#include "common/base/log.h"
#include "common/base/safe_text.h"
#include "coordinator/store/blobs/s3_request.h"
#include "coordinator/store/files.h"

namespace ls::coordinator {
namespace {

constexpr std::uint64_t kMostParts = 10'000;  // the protocol's limit on the parts of an object
constexpr std::uint64_t kChunk = 1u << 20;

Result<Digest> digest_of(const std::filesystem::path& path, std::uint64_t offset, std::uint64_t bytes) {
  auto file = File::open(path, O_RDONLY);
  if (!file) return tl::unexpected(file.error());
  Sha256 hash;
  for (const std::uint64_t end = offset + bytes; offset < end; offset += kChunk) {
    const auto chunk = read_at(*file, offset, static_cast<std::size_t>(std::min(kChunk, end - offset)), path);
    if (!chunk) return tl::unexpected(chunk.error());
    hash.update(*chunk);
  }
  return hash.finish();
}

}  // namespace

Result<void> S3Link::put_parts(const std::string& key, const std::filesystem::path& file,
                               std::uint64_t bytes) const {
  auto upload = begin_parts(key);
  if (!upload) return tl::unexpected(upload.error());
  auto done = send_parts(key, *upload, file, bytes);
  if (!done) give_up_parts(key, *upload);
  return done;
}

Result<std::string> S3Link::begin_parts(const std::string& key) const {
  const Request request{.method = "POST", .key = key, .query = "uploads="};
  const auto answer = ask(request);
  if (!answer) return tl::unexpected(answer.error());
  const std::string id = xml_element(answer->text, "UploadId");
  if (answer->status != 200 || id.empty()) return tl::unexpected(error_of(request, *answer));
  return id;
}

Result<void> S3Link::send_parts(const std::string& key, const std::string& upload,
                                const std::filesystem::path& file, std::uint64_t bytes) const {
  const std::uint64_t part_bytes =
      std::max(options_.address.part_bytes, (bytes + kMostParts - 1) / kMostParts);
  Request end{.method = "POST",
              .key = key,
              .query = "uploadId=" + percent_encode(upload),
              .body = "<CompleteMultipartUpload>"};
  int number = 1;
  for (std::uint64_t offset = 0; offset < bytes; offset += part_bytes, ++number) {
    Request part{.method = "PUT",
                 .key = key,
                 .query = fmt::format("partNumber={}&uploadId={}", number, percent_encode(upload))};
    part.file = file;
    part.offset = offset;
    part.bytes = std::min(part_bytes, bytes - offset);
    const auto digest = digest_of(file, offset, part.bytes);
    if (!digest) return tl::unexpected(digest.error());
    part.payload = digest->hex();
    const auto answer = ask(part);
    if (!answer) return tl::unexpected(answer.error());
    if (answer->status / 100 != 2 || answer->etag.empty()) return tl::unexpected(error_of(part, *answer));
    end.body += fmt::format("<Part><PartNumber>{}</PartNumber><ETag>{}</ETag></Part>", number, answer->etag);
  }
  end.body += "</CompleteMultipartUpload>";
  end.payload = sha256(end.body).hex();
  const auto answer = ask(end);
  if (!answer) return tl::unexpected(answer.error());
  // The store begins its answer before it has joined the parts, so an answer with status 200 may contain an
  // error.
  if (answer->status / 100 == 2 && xml_element(answer->text, "Code").empty()) return {};
  // If the answer to an earlier attempt was lost, the upload may be complete, and the store no longer accepts
  // its id: then the object exists.
  if (const auto there = look_at(key); there && there->bytes == bytes) return {};
  return tl::unexpected(error_of(end, *answer));
}

// Deletes the parts sent so far in the store. Otherwise the store would keep them, invisible but charged for.
void S3Link::give_up_parts(const std::string& key, const std::string& upload) const {
  const Request request{.method = "DELETE", .key = key, .query = "uploadId=" + percent_encode(upload)};
  const auto answer = ask(request);
  if (!answer || (answer->status / 100 != 2 && answer->status != 404))
    log_warn("store=s3", fmt::format("the parts of {} that were sent stay in {}: {}", key, shown(),
                                     answer ? error_of(request, *answer).message : answer.error().message));
}

}  // namespace ls::coordinator
