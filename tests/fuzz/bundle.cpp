// Archives with a scene and its files. The first byte says zip or tar.
#include <archive.h>
#include <archive_entry.h>
#include <sys/mman.h>
#include <unistd.h>

#include "coordinator/http/bundle/bundle.h"
#include "coordinator/store/blobs/memory_blobs.h"
#include "tests/fuzz/all_targets.h"

namespace ls::fuzz {
namespace {

using http::ArchiveKind;

std::string packed(bool zip, bool gzip, const std::vector<std::pair<std::string, std::string>>& files) {
  std::string out;
  archive* a = archive_write_new();
  zip ? archive_write_set_format_zip(a) : archive_write_set_format_pax_restricted(a);
  if (gzip) archive_write_add_filter_gzip(a);
  archive_write_set_bytes_in_last_block(a, 1);
  const auto append = [](archive*, void* to, const void* data, std::size_t n) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(data), n);
    return static_cast<la_ssize_t>(n);
  };
  archive_write_open2(a, &out, nullptr, append, nullptr, nullptr);
  for (const auto& [name, bytes] : files) {
    archive_entry* e = archive_entry_new();
    archive_entry_set_pathname(e, name.c_str());
    archive_entry_set_filetype(e, AE_IFREG);
    archive_entry_set_perm(e, 0644);
    archive_entry_set_mtime(e, 0, 0);
    archive_entry_set_size(e, static_cast<la_int64_t>(bytes.size()));
    archive_write_header(a, e);
    archive_write_data(a, bytes.data(), bytes.size());
    archive_entry_free(e);
  }
  archive_write_close(a);
  archive_write_free(a);
  return out;
}

}  // namespace

void bundle(Bytes input) {
  if (input.empty()) return;
  const Bytes file = input.subspan(1);
  const int fd = ::memfd_create("bundle", MFD_CLOEXEC);
  must(fd >= 0 && ::write(fd, file.data(), file.size()) == static_cast<ssize_t>(file.size()),
       "there is a file to read");
  coordinator::MemoryBlobs blobs;
  const http::BundleLimits limits{1 << 20, 4 << 20};
  const auto got = http::read_bundle(fd, file.size(), input[0] == 'z' ? ArchiveKind::zip : ArchiveKind::tar,
                                     limits, blobs, {});
  ::close(fd);
  if (!got) return must(!got.error().message.empty(), "what is refused is told why");
  must(blobs.has(got->scene_digest), "the scene of a bundle is in the store");
  for (const auto& [name, digest] : got->assets) {
    must(blobs.has(digest), "the files of a bundle are in the store");
    must(!name.empty() && name[0] != '/' && !name.ends_with("/.."), "no name leads elsewhere");
  }
}

Seeds bundle_seeds() {
  const std::vector<std::pair<std::string, std::string>> files{{"job.json", R"({"scene":"a.xml","spp":4})"},
                                                               {"./a.xml", "<scene/>"},
                                                               {"b/fog.vol", std::string(300, 'x')}};
  return {"z" + packed(true, false, files), "t" + packed(false, false, files),
          "t" + packed(false, true, files),
          "z" + packed(true, false, {{"top/only.xml", "<scene/>"}, {"top/x.png", ""}})};
}

}  // namespace ls::fuzz
