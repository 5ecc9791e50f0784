// Tells what the bytes of a file are, whatever its name says: a file packed by gzip, the pointer that Git LFS
// leaves in place of a file, or text in another encoding than UTF-8. All files of scenes pass through here,
// so that each reader of a format sees the plain bytes of a file of its format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace ls {

// The number of first bytes that the functions below look at.
inline constexpr std::size_t kFormBytes = 64;

// Largest size of an unpacked gzip file, in bytes: 4 GiB. A small file can claim to unpack to any size.
inline constexpr std::uint64_t kMaxUnpackedBytes = std::uint64_t{4} << 30;

// True if `head`, the first bytes of a file, are those of a gzip file (RFC 1952).
bool is_gzip(std::string_view head);

// If the file that begins with `head` is only a placeholder of the real one, returns what it is and what to
// do, as the end of a sentence that begins with the file's name ("is a pointer of Git LFS, ..."); else "".
std::string why_placeholder(std::string_view head);

// If `text` is not UTF-8 but UTF-16 or UTF-32, by its byte order mark or its zeros, returns that and what to
// do, as the end of a sentence ("is text in UTF-16: save it as UTF-8"); else "".
std::string why_no_utf8(std::string_view text);

// Returns the text without the byte order mark (U+FEFF in UTF-8) that some editors write at its beginning.
std::string_view without_mark(std::string_view text);

// If the file may have been cut short, returns why, as the end of a sentence that begins with the file's
// name; else "". Formats of text have no mark of their end: of an OBJ, IES or ASCII PLY file it can only be
// told whether its last line has a line end, and of an OBJ whether faces follow its last vertices. `head` is
// the file's beginning, `tail` its end, both of kFormBytes or the whole file.
std::string why_perhaps_cut(std::string_view name, std::string_view head, std::string_view tail);

// Returns the name without a last ".gz", in lower or upper case: "smoke.vdb" for "smoke.vdb.gz".
std::string_view without_gz(std::string_view name);

// Returns the bytes that a reader of the file's format should see. Unpacks gzip, also of several members one
// after the other. Fails with invalid_argument if the file is a placeholder or its gzip data are damaged or
// cut short (gzip has a checksum), and with resource_exhausted if it unpacks to more than `limit` bytes. The
// message begins with the file's name in quotes.
Result<std::vector<std::byte>> plain_bytes(std::string_view name, std::vector<std::byte> bytes,
                                           std::uint64_t limit = kMaxUnpackedBytes);
Result<std::string> plain_bytes(std::string_view name, std::string bytes,
                                std::uint64_t limit = kMaxUnpackedBytes);

}  // namespace ls
