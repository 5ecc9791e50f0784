#include "cli/output_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>

#include "coordinator/store/files.h"

namespace ls::cli {

namespace fs = std::filesystem;

Result<void> check_output(const std::string& option, const fs::path& file) {
  std::error_code error;
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error))
    return fail(Errc::invalid_argument,
                fmt::format("{} {}: there is no folder {}", option, file.string(), folder.string()));
  if (fs::is_directory(file, error))
    return fail(Errc::invalid_argument, fmt::format("{} {}: this is a folder", option, file.string()));
  return {};
}

Result<void> write_output(const fs::path& file, std::span<const std::byte> bytes) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status) || fs::is_regular_file(status))
    return coordinator::write_atomically(fs::absolute(file, error), bytes);
  std::ofstream out(file, std::ios::binary);  // a pipe or device: nothing can be renamed over it
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) return fail(Errc::unavailable, fmt::format("{} cannot be written", file.string()));
  return {};
}

Result<void> write_output(const fs::path& file, const std::string& text) {
  return write_output(file, std::as_bytes(std::span(text)));
}

}  // namespace ls::cli
