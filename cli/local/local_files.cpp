#include "cli/local/local_files.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "coordinator/store/files.h"

namespace ls::cli {
namespace {

struct HereFile final : worker::BlobFile {
  explicit HereFile(std::filesystem::path p) : file(std::move(p)) {}
  const std::filesystem::path& path() const override { return file; }
  std::filesystem::path file;
};

// A file in memory. Its path leads through this process's /proc entry, so that a render child (a child
// process that renders) can open it too.
struct MemoryFile final : worker::BlobFile {
  explicit MemoryFile(coordinator::File f)
      : file(std::move(f)), name(fmt::format("/proc/{}/fd/{}", ::getpid(), file.fd())) {}
  const std::filesystem::path& path() const override { return name; }
  coordinator::File file;
  std::filesystem::path name;
};

}  // namespace

Result<std::shared_ptr<const worker::BlobFile>> LocalBlobFiles::acquire(const BlobRef& blob) {
  if (auto path = blobs_->adopted(blob.digest)) return std::make_shared<const HereFile>(std::move(*path));
  const auto size = blobs_->size(blob.digest);
  if (!size) return tl::unexpected(size.error());
  const auto bytes = blobs_->read(blob.digest, 0, *size);
  if (!bytes) return fail(Errc::failed_precondition, bytes.error().message);
  coordinator::File file(::memfd_create("lightshaft-blob", MFD_CLOEXEC));
  if (!file)
    return fail(Errc::failed_precondition,
                fmt::format("no file in memory can be made: {}", std::strerror(errno)));
  auto memory = std::make_shared<const MemoryFile>(std::move(file));
  if (auto written = coordinator::write_all(memory->file, *bytes, memory->path()); !written)
    return fail(Errc::failed_precondition, written.error().message);
  return memory;
}

}  // namespace ls::cli
