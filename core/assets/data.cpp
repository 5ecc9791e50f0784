#include "core/assets/data.h"

#include <fmt/format.h>

#include <fstream>
#include <utility>

#include "core/base/file_form.h"

namespace ls {

Result<std::vector<std::byte>> read_asset(const std::filesystem::path& path, std::string_view name,
                                          std::uint64_t limit) {
  std::error_code ec;
  const std::uint64_t size = std::filesystem::file_size(path, ec);
  if (ec) return fail(Errc::not_found, fmt::format("'{}': cannot be read: {}", name, ec.message()));
  if (size > limit)
    return fail(Errc::resource_exhausted,
                fmt::format("'{}': {} bytes, more than the limit of {}", name, size, limit));
  std::vector<std::byte> bytes(size);
  std::ifstream in(path, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!in || static_cast<std::uint64_t>(in.gcount()) != size)
    return fail(Errc::unavailable, fmt::format("'{}': could not be read to its end", name));
  return plain_bytes(name, std::move(bytes));
}

}  // namespace ls
