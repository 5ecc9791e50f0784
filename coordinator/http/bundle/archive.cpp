#include "coordinator/http/bundle/archive.h"

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <locale.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "coordinator/http/message/limits.h"
#include "core/base/safe_text.h"

namespace ls::http {
namespace {

constexpr std::size_t kReadBlock = 64u << 10;
constexpr std::int64_t kTarBlock = 512;

// Sets a UTF-8 locale for this thread while the object lives: libarchive converts names to the thread's
// locale, and in the locale "C" it would lose all characters but ASCII.
class Utf8Names {
 public:
  Utf8Names() : before_(locale() ? ::uselocale(locale()) : nullptr) {}
  ~Utf8Names() {
    if (before_) ::uselocale(before_);
  }
  Utf8Names(const Utf8Names&) = delete;

 private:
  static locale_t locale() {
    static const locale_t utf8 = ::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
    return utf8;
  }
  locale_t before_;
};

enum class Trouble { none, stopped, unreadable, list_too_long };

// The archive's bytes, which libarchive reads through callbacks.
struct Source {
  int fd = -1;
  std::int64_t size = 0, at = 0;
  // Number of bytes that libarchive may still read before the first entry. For a zip it reads the list of
  // all entries first and keeps it in memory, so the size of that list must be limited.
  std::int64_t list_bytes_left = static_cast<std::int64_t>(kMaxArchiveList);
  bool reads_list = true;
  std::stop_token stop;
  Trouble trouble = Trouble::none;
  std::array<char, kReadBlock> block;

  static la_ssize_t read(archive*, void* self_pointer, const void** out) {
    auto& self = *static_cast<Source*>(self_pointer);
    if (self.stop.stop_requested()) return self.give_up(Trouble::stopped);
    ssize_t n = 0;
    do n = ::pread(self.fd, self.block.data(), self.block.size(), self.at);
    while (n < 0 && errno == EINTR);
    if (n < 0) return self.give_up(Trouble::unreadable);
    if (self.reads_list && (self.list_bytes_left -= n) < 0) return self.give_up(Trouble::list_too_long);
    self.at += n;
    *out = self.block.data();
    return n;
  }
  static la_int64_t skip(archive*, void* self_pointer, la_int64_t bytes) {
    auto& self = *static_cast<Source*>(self_pointer);
    const std::int64_t skipped =
        std::clamp<std::int64_t>(bytes, 0, std::max<std::int64_t>(self.size - self.at, 0));
    self.at += skipped;
    return skipped;
  }
  static la_int64_t seek(archive*, void* self_pointer, la_int64_t offset, int whence) {
    auto& self = *static_cast<Source*>(self_pointer);
    const std::int64_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? self.at : self.size;
    std::int64_t to = 0;
    if (__builtin_add_overflow(from, offset, &to) || to < 0) return ARCHIVE_FATAL;
    return self.at = to;
  }
  int give_up(Trouble why) {
    trouble = why;
    return ARCHIVE_FATAL;
  }
};

ArchiveEntry::Kind kind_of(archive_entry* e) {
  if (archive_entry_hardlink(e) || archive_entry_symlink(e)) return ArchiveEntry::Kind::link;
  switch (archive_entry_filetype(e)) {
    case AE_IFREG:
      return ArchiveEntry::Kind::file;
    case AE_IFDIR:
      return ArchiveEntry::Kind::folder;
    case AE_IFLNK:
      return ArchiveEntry::Kind::link;
    default:
      return ArchiveEntry::Kind::other;
  }
}

}  // namespace

struct ArchiveReader::State {
  Source source;
  ArchiveKind kind = ArchiveKind::zip;
  std::unique_ptr<archive, decltype([](archive* a) { archive_read_free(a); })> reader;
  // end of the current entry's data, in bytes of the unpacked tar
  std::int64_t data_end = 0;

  Error error(std::string_view doing) const;
  std::int64_t position() const { return archive_filter_bytes(reader.get(), 0); }
};

Error ArchiveReader::State::error(std::string_view doing) const {
  switch (source.trouble) {
    case Trouble::stopped:
      return {Errc::unavailable, "the coordinator is stopping: send the bundle again"};
    case Trouble::unreadable:
      return {Errc::unavailable, "the coordinator cannot read back what it received: send the bundle again"};
    case Trouble::list_too_long:
      return {Errc::invalid_argument,
              fmt::format("the archive's list of entries has more than {} bytes", kMaxArchiveList)};
    case Trouble::none:
      break;
  }
  const char* text = archive_error_string(reader.get());
  return {Errc::invalid_argument, fmt::format("{}: the archive is damaged or cut off ({})", doing,
                                              plain_text(text ? text : "no reason known"))};
}

ArchiveReader::ArchiveReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
ArchiveReader::ArchiveReader(ArchiveReader&&) noexcept = default;
ArchiveReader::~ArchiveReader() = default;

Result<ArchiveReader> ArchiveReader::open(int fd, ArchiveKind kind, std::stop_token stop) {
  const Utf8Names names;
  auto state = std::make_unique<State>();
  struct stat info {};
  if (::fstat(fd, &info) != 0)
    return fail(Errc::unavailable, fmt::format("the bundle cannot be read back: {}", std::strerror(errno)));
  state->source.fd = fd;
  state->source.size = info.st_size;
  state->source.stop = std::move(stop);
  state->kind = kind;
  state->reader.reset(archive_read_new());
  archive* a = state->reader.get();
  if (!a) return fail(Errc::unavailable, "not enough memory to read an archive");
  // A zip is read only through the list of entries at its end, so a zip that was cut off is an error.
  bool ready = kind == ArchiveKind::zip ? archive_read_support_format_zip_seekable(a) == ARCHIVE_OK
                                        : archive_read_support_format_tar(a) == ARCHIVE_OK &&
                                              archive_read_support_filter_gzip(a) == ARCHIVE_OK;
  Source* source = &state->source;
  ready = ready && archive_read_set_read_callback(a, &Source::read) == ARCHIVE_OK &&
          archive_read_set_skip_callback(a, &Source::skip) == ARCHIVE_OK &&
          archive_read_set_seek_callback(a, &Source::seek) == ARCHIVE_OK &&
          archive_read_set_callback_data(a, source) == ARCHIVE_OK;
  if (!ready) return fail(Errc::internal, "libarchive was built without zip, tar or gzip");
  if (archive_read_open1(a) != ARCHIVE_OK)
    return tl::unexpected(
        state->error(fmt::format("this is no {} archive", kind == ArchiveKind::zip ? "zip" : "tar")));
  return ArchiveReader(std::move(state));
}

Result<std::optional<ArchiveEntry>> ArchiveReader::next() {
  const Utf8Names names;
  State& s = *state_;
  archive* a = s.reader.get();
  archive_entry* e = nullptr;
  const int code = archive_read_next_header(a, &e);
  s.source.reads_list = false;
  if (code == ARCHIVE_EOF) {
    // A complete tar ends with a block of zeros. If nothing follows the last entry, the file was cut off
    // between two entries.
    const std::int64_t padded = (s.data_end + kTarBlock - 1) / kTarBlock * kTarBlock;
    if (s.kind == ArchiveKind::tar && s.position() <= padded)
      return fail(Errc::invalid_argument,
                  "the archive is cut off: a tar ends with blocks of zeros, which are missing");
    return std::optional<ArchiveEntry>();
  }
  const char* name = e ? archive_entry_pathname(e) : nullptr;
  if (code != ARCHIVE_OK || s.source.trouble != Trouble::none)
    return tl::unexpected(s.error(
        name && *name ? fmt::format("\"{}\"", plain_text(std::string_view(name).substr(0, kMaxAssetName)))
                      : std::string("looking for the next entry")));
  ArchiveEntry entry;
  if (name) entry.name = name;
  entry.kind = kind_of(e);
  if (archive_entry_size_is_set(e))
    entry.bytes = static_cast<std::uint64_t>(std::max<la_int64_t>(archive_entry_size(e), 0));
  entry.encrypted = archive_entry_is_encrypted(e) != 0;
  if (s.kind == ArchiveKind::zip) {
    // archive_format_name() returns, for example, "ZIP 2.0 (deflation)". libarchive reports the compression
    // method of an entry nowhere else.
    const std::string_view format = archive_format_name(a);
    entry.packed_oddly = !format.ends_with("(deflation)") && !format.ends_with("(uncompressed)");
  }
  return std::optional(std::move(entry));
}

Result<std::size_t> ArchiveReader::read(std::span<std::byte> into) {
  State& s = *state_;
  const la_ssize_t n = archive_read_data(s.reader.get(), into.data(), into.size());
  if (n < 0 || s.source.trouble != Trouble::none) return tl::unexpected(s.error("reading it"));
  if (n == 0) s.data_end = s.position();
  return static_cast<std::size_t>(n);
}

}  // namespace ls::http
