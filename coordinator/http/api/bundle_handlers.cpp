// POST /api/v1/jobs with a zip or tar: the body is spooled to disk, checked, stored file by file, and
// submitted.
#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "common/base/error.h"
#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/bundle/bundle.h"

namespace ls::http {
namespace {

// Buffers a request's body on disk, in an unnamed file that disappears with the Spool object or the process.
class Spool {
 public:
  // Creates the file in `folder`, which is created if it is missing. An empty path means the system's folder
  // for temporary files.
  static Result<Spool> open(const std::filesystem::path& folder);
  ~Spool();
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&&) = delete;

  Result<void> append(std::span<const std::byte> bytes);  // resource_exhausted: the disk is full
  int fd() const { return fd_; }
  std::uint64_t size() const { return size_; }

 private:
  explicit Spool(int fd) : fd_(fd) {}
  int fd_ = -1;
  std::uint64_t size_ = 0;
};
tl::unexpected<Error> failed(std::string_view what, int code) {
  const bool full = code == ENOSPC || code == EDQUOT || code == EFBIG;
  return fail(full ? Errc::resource_exhausted : Errc::unavailable,
              fmt::format("{} for the request's body: {}{}", what, std::strerror(code),
                          full ? "; free some space on the coordinator's disk and send it again" : ""));
}

Result<Spool> Spool::open(const std::filesystem::path& folder) {
  std::error_code error;
  const auto place = folder.empty() ? std::filesystem::temp_directory_path(error) : folder;
  if (!error) std::filesystem::create_directories(place, error);
  if (error) return failed("no folder", error.value());
  std::string name = (place / "body-XXXXXX").string();
  const int fd = ::mkostemp(name.data(), O_CLOEXEC);
  if (fd < 0) return failed("no file", errno);
  ::unlink(name.c_str());
  return Spool(fd);
}

Spool::Spool(Spool&& other) noexcept : fd_(std::exchange(other.fd_, -1)), size_(other.size_) {}

Spool::~Spool() {
  if (fd_ >= 0) ::close(fd_);
}

Result<void> Spool::append(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failed("no room", errno);
    size_ += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

class BundleSink final : public BodySink {
 public:
  BundleSink(Api& api, Spool spool, ArchiveKind kind, const Request& request)
      : api_(api),
        spool_(std::move(spool)),
        kind_(kind),
        query_(request.query),
        caller_(request.caller),
        traceparent_(request.header("traceparent")) {}

  std::optional<Response> append(std::span<const std::byte> bytes) override {
    if (bytes.size() > api_.limits().bundle_bytes - spool_.size())
      return problem(413, fmt::format("the bundle has more than the {} bytes that are accepted",
                                      api_.limits().bundle_bytes));
    if (const auto done = spool_.append(bytes); !done) return problem(done.error());
    return std::nullopt;
  }

  Response finish() override {
    return guarded("bundle", [this] { return submit(); });
  }

 private:
  Response submit() {
    const BundleLimits limits{api_.limits().blob_bytes, api_.limits().unpacked_bytes};
    const auto bundle =
        read_bundle(spool_.fd(), spool_.size(), kind_, limits, api_.coordinator().blobs(), api_.stop_token());
    if (!bundle) return problem(bundle.error());
    coordinator::SubmitRequest job;
    auto spec = spec_from_query(query_, "", bundle->spec);
    if (!spec) return problem(spec.error());
    job.spec = std::move(*spec);
    auto text = read_scene_blob(api_, bundle->scene_digest);
    if (!text) return problem(text.error());
    job.scene_text = std::move(*text);
    job.scene_name = bundle->scene;
    job.assets = bundle->assets;
    job.owner = caller_.user;
    job.traceparent = traceparent_;
    return submit_job(api_, std::move(job), caller_);
  }

  Api& api_;
  Spool spool_;
  ArchiveKind kind_;
  Fields query_;
  Caller caller_;
  std::string traceparent_;
};

}  // namespace

std::variant<Response, std::unique_ptr<BodySink>> open_bundle(Api& api, const Request& request) {
  if (!request.header("content-encoding").empty())
    return problem(415, "send the bundle as it is: Content-Encoding is not decoded");
  // The query is checked before the body, which may have gigabytes, is received.
  const auto spec = spec_from_query(request.query, "");
  if (!spec) return problem(spec.error());
  if (auto refused = refuse_priority(api, request.caller, spec->priority)) return std::move(*refused);
  auto spool = Spool::open(api.limits().spool);
  if (!spool) return problem(spool.error());
  const bool zip = media_type(request.header("content-type")).find("zip") != std::string::npos &&
                   media_type(request.header("content-type")).find("gzip") == std::string::npos;
  return std::make_unique<BundleSink>(api, std::move(*spool), zip ? ArchiveKind::zip : ArchiveKind::tar,
                                      request);
}

}  // namespace ls::http
