#include "core/base/file_form.h"

#include <fmt/format.h>
#include <strings.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <new>

namespace ls {
namespace {

constexpr std::string_view kPointer = "version https://git-lfs.github.com/spec/";

// Unpacks all members of a gzip file, which follow each other. `Bytes` is a vector of bytes or a string.
template <class Bytes>
Result<Bytes> unpacked(std::string_view name, const Bytes& packed, std::uint64_t limit) {
  constexpr std::size_t kFirst = std::size_t{1} << 16, kStep = std::size_t{1} << 24;
  constexpr int kGzipWindow = 15 + 16;  // the largest window; 16 stands for the format gzip
  struct Stream {
    z_stream z{};
    ~Stream() { inflateEnd(&z); }
  } s;
  const auto damaged = [&] {
    return bad_argument(fmt::format("'{}': is packed by gzip, and damaged or cut short", name));
  };
  if (inflateInit2(&s.z, kGzipWindow) != Z_OK)
    return fail(Errc::resource_exhausted, fmt::format("'{}': no memory to unpack it", name));
  Bytes out;
  std::size_t taken = 0, made = 0;
  while (true) {
    if (s.z.avail_in == 0) {
      const std::size_t n = std::min(packed.size() - taken, kStep);
      s.z.next_in = reinterpret_cast<Bytef*>(const_cast<typename Bytes::value_type*>(packed.data())) + taken;
      s.z.avail_in = static_cast<uInt>(n);
      taken += n;
    }
    if (made == out.size()) {
      if (made > limit)
        return fail(
            Errc::resource_exhausted,
            fmt::format(
                "'{}': unpacks to more than {} bytes: unpack it by gunzip, and name the unpacked file", name,
                limit));
      out.resize(made + std::clamp(made, kFirst, kStep));
    }
    s.z.next_out = reinterpret_cast<Bytef*>(out.data()) + made;
    s.z.avail_out = static_cast<uInt>(std::min<std::size_t>(out.size() - made, kStep));
    const uInt room = s.z.avail_out;
    const int result = inflate(&s.z, Z_NO_FLUSH);
    made += room - s.z.avail_out;
    if (result == Z_STREAM_END) {
      // Zeros after the last member are padding, as gzip itself allows.
      if (s.z.avail_in > 0 ? *s.z.next_in == 0 : taken == packed.size()) break;
      if (inflateReset(&s.z) != Z_OK) return damaged();
    } else if (result != Z_OK && result != Z_BUF_ERROR) {
      return damaged();
    } else if (s.z.avail_in == 0 && taken == packed.size() && s.z.avail_out > 0) {
      return damaged();  // the data end before their end mark
    }
  }
  if (made > limit)
    return fail(
        Errc::resource_exhausted,
        fmt::format("'{}': unpacks to more than {} bytes: unpack it by gunzip, and name the unpacked file",
                    name, limit));
  out.resize(made);
  return out;
}

template <class Bytes>
Result<Bytes> plain(std::string_view name, Bytes bytes, std::uint64_t limit) {
  const auto head = [](const Bytes& b) {
    return std::string_view(reinterpret_cast<const char*>(b.data()), std::min(b.size(), kFormBytes));
  };
  try {
    if (is_gzip(head(bytes))) {
      auto out = unpacked(name, bytes, limit);
      if (!out) return out;
      bytes = std::move(*out);
    }
  } catch (const std::bad_alloc&) {
    return fail(Errc::resource_exhausted, fmt::format("'{}': not enough memory to unpack it", name));
  }
  if (const std::string why = why_placeholder(head(bytes)); !why.empty())
    return bad_argument(fmt::format("'{}': {}", name, why));
  return bytes;
}

}  // namespace

bool is_gzip(std::string_view head) { return head.starts_with("\x1f\x8b\x08"); }

std::string why_placeholder(std::string_view head) {
  if (!without_mark(head).starts_with(kPointer)) return {};
  return "is a pointer of Git LFS, not the file itself: run `git lfs pull` in the repository it comes from";
}

namespace {

// True if the last statement of an OBJ file is a vertex, a normal or a texture coordinate.
bool ends_in_vertex(std::string_view tail) {
  while (!tail.empty()) {
    const auto end = tail.find_last_not_of("\r\n");
    if (end == tail.npos) return false;
    const auto before = tail.find_last_of("\r\n", end);
    if (before == tail.npos) return false;  // perhaps not the beginning of the line
    std::string_view line = tail.substr(before + 1, end - before);
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    if (!line.empty() && line[0] != '#') {
      const std::string_view key = line.substr(0, line.find_first_of(" \t"));
      return key == "v" || key == "vn" || key == "vt";
    }
    tail = tail.substr(0, before);
  }
  return false;
}

}  // namespace

std::string why_perhaps_cut(std::string_view name, std::string_view head, std::string_view tail) {
  if (head.empty() || tail.empty() || is_gzip(head)) return {};
  const auto ends_in = [&](std::string_view end) {
    return name.size() >= end.size() &&
           ::strncasecmp(name.data() + name.size() - end.size(), end.data(), end.size()) == 0;
  };
  const bool is_ply = without_mark(head).starts_with("ply");
  const bool is_obj = !is_ply && ends_in(".obj");
  const bool is_text = is_ply ? head.find("format ascii") != head.npos : is_obj || ends_in(".ies");
  if (!is_text) return {};
  if (tail.back() == '\n' || tail.back() == '\r')
    return is_obj && ends_in_vertex(tail)
               ? "ends in vertices, which no face after them uses: it may have been cut short"
               : "";
  return "ends within a line: it may have been cut short; if it is whole, put a line end at its end";
}

std::string why_no_utf8(std::string_view text) {
  using namespace std::string_view_literals;
  if (text.starts_with("\xff\xfe\0\0"sv) || text.starts_with("\0\0\xfe\xff"sv))
    return "is text in UTF-32: save it as UTF-8";
  const bool no_mark_little =
      text.size() >= 4 && text[0] != 0 && text[1] == 0 && text[2] != 0 && text[3] == 0;
  const bool no_mark_big = text.size() >= 4 && text[0] == 0 && text[1] != 0 && text[2] == 0 && text[3] != 0;
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff") || no_mark_little || no_mark_big)
    return "is text in UTF-16: save it as UTF-8";
  return {};
}

std::string_view without_mark(std::string_view text) {
  return text.starts_with("\xef\xbb\xbf") ? text.substr(3) : text;
}

std::string_view without_gz(std::string_view name) {
  return name.ends_with(".gz") || name.ends_with(".GZ") ? name.substr(0, name.size() - 3) : name;
}

Result<std::vector<std::byte>> plain_bytes(std::string_view name, std::vector<std::byte> bytes,
                                           std::uint64_t limit) {
  return plain(name, std::move(bytes), limit);
}
Result<std::string> plain_bytes(std::string_view name, std::string bytes, std::uint64_t limit) {
  return plain(name, std::move(bytes), limit);
}

}  // namespace ls
