#include "cli/output/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "coordinator/store/files.h"

namespace ls::cli {

namespace fs = std::filesystem;

namespace {
constexpr unsigned kByUmask = 0666;  // who else may read a result is for the umask of its user to say
}

Result<void> check_output(const std::string& option, const fs::path& file) {
  std::error_code error;
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error))
    return bad_argument(fmt::format("{} {}: there is no folder {}", option, file.string(), folder.string()));
  const fs::file_status status = fs::status(file, error);
  if (fs::is_directory(status))
    return bad_argument(fmt::format("{} {}: this is a folder", option, file.string()));
  if (!fs::exists(status) || fs::is_regular_file(status)) return check_folder(option, folder);
  if (::access(file.c_str(), W_OK) != 0)
    return bad_argument(
        fmt::format("{} {}: cannot be written: {}", option, file.string(), std::strerror(errno)));
  return {};
}

Result<ImageFormat> image_format(const fs::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending.empty() || ending == ".exr") return ImageFormat::exr;
  if (ending == ".png") return ImageFormat::png;
  if (ending == ".json") return ImageFormat::json;
  return bad_argument(
      fmt::format("-o {}: an image is written as .exr (all layers) or .png (8-bit colours), and what meters "
                  "measure as .json",
                  file.string()));
}

Result<void> check_view(const std::string& view, const std::string& out) {
  if (!view.empty() && image_format(out) != ImageFormat::png)
    return bad_argument(
        "--view: it is for images that are written as PNG, such as -o image.png; an EXR has linear "
        "colours");
  return {};
}

Result<std::shared_ptr<const DisplayViews>> views_for(const std::string& view, const std::string& out) {
  if (view.empty()) return nullptr;
  if (const auto ok = check_view(view, out); !ok) return tl::unexpected(ok.error());
  auto views = view == kPlainView ? DisplayViews::built_in() : DisplayViews::of_environment();
  if (!views) return tl::unexpected(views.error());
  if (const auto found = views->left_out().find(view); found != views->left_out().end())
    return bad_argument(fmt::format("--view: the view '{}' cannot be shown: {}", view, found->second));
  if (const auto found = views->view(view); !found) return bad_argument("--view: " + found.error().message);
  return std::make_shared<const DisplayViews>(std::move(*views));
}

fs::path deep_file(const fs::path& image) {
  fs::path deep = image;
  if (image_format(image) == ImageFormat::png) return deep += ".deep.exr";
  return deep.replace_extension(".deep.exr");
}

Result<void> check_folder(const std::string& option, const fs::path& folder) {
  std::string trial = (folder / ".lightshaft-XXXXXX").string();
  const coordinator::File made(::mkostemp(trial.data(), O_CLOEXEC));
  if (!made)
    return bad_argument(fmt::format("{}: no file can be made in the folder {}: {}", option, folder.string(),
                                    std::strerror(errno)));
  ::unlink(trial.c_str());
  return {};
}

Result<void> check_numbered(const std::string& option, const std::string& name, const FrameRange& frames) {
  if (has_frame_number(name) || frames.count() == 1) return {};
  const fs::path path(name);
  const fs::path better = path.parent_path() / (path.stem().string() + "_####" + path.extension().string());
  return bad_argument(
      fmt::format("{} {}: {} frames need as many names, for example {}, where #### is the frame's number",
                  option, name, frames.count(), better.string()));
}

Result<void> check_outputs(const std::string& option, const std::string& name,
                           const std::optional<FrameRange>& frames) {
  if (option == "-o")
    if (const auto format = image_format(name); !format) return tl::unexpected(format.error());
  if (!frames) return check_output(option, name);
  if (option != "--report")
    if (auto ok = check_numbered(option, name, *frames); !ok) return ok;
  for (const std::uint32_t frame : frames->frames()) {
    if (auto ok = check_output(option, numbered(name, frame)); !ok) return ok;
    if (!has_frame_number(name)) break;
  }
  return {};
}

Result<void> write_output(const fs::path& file, std::span<const std::byte> bytes) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status) || fs::is_regular_file(status))
    return coordinator::write_atomically(fs::absolute(file, error), bytes, kByUmask);
  // A pipe or device cannot be replaced by renaming, so it is written directly.
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) return fail(Errc::unavailable, fmt::format("{} cannot be written", file.string()));
  return {};
}

Result<void> write_output(const fs::path& file, const std::string& text) {
  return write_output(file, std::as_bytes(std::span(text)));
}

Result<void> save_result(const fs::path& file, std::span<const std::byte> bytes) {
  auto written = write_output(file, bytes);
  if (written) return written;
  std::error_code error;
  std::string aside =
      (fs::temp_directory_path(error) / "lightshaft-XXXXXX").string() + file.extension().string();
  const int suffix = static_cast<int>(file.extension().string().size());
  const coordinator::File rescue(error ? -1 : ::mkostemps(aside.data(), suffix, O_CLOEXEC));
  if (!rescue) return written;
  if (auto rescued = coordinator::write_all(rescue, bytes, aside); !rescued) {
    ::unlink(aside.c_str());
    return written;
  }
  return fail(written.error().code,
              fmt::format("{}; what was to be written there is in {}", written.error().message, aside));
}

Result<void> save_result(const fs::path& file, const std::string& text) {
  return save_result(file, std::as_bytes(std::span(text)));
}

Result<PartialDir> PartialDir::open(fs::path folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return fail(Errc::unavailable,
                fmt::format("--partial-dir {} cannot be made: {}", folder.string(), error.message()));
  if (auto ok = check_folder("--partial-dir", folder); !ok) return tl::unexpected(ok.error());
  return PartialDir(std::move(folder));
}

fs::path PartialDir::path(TileIndex tile, RoundIndex round) const {
  return folder_ / fmt::format("tile-{:06}-round-{:05}.exr", tile, round);
}

Result<void> PartialDir::keep(const UnitResult& result) {
  const fs::path file = path(result.unit.tile, result.unit.round);
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(result.exr.data()),
            static_cast<std::streamsize>(result.exr.size()));
  out.close();
  if (!out) return fail(Errc::resource_exhausted, fmt::format("{} cannot be written", file.string()));
  kept_.emplace_back(result.unit.tile, result.unit.round);
  return {};
}

Result<void> PartialDir::drop_unfolded(std::span<const RoundIndex> folded) {
  for (const auto& [tile, round] : kept_) {
    if (tile < folded.size() && round < folded[tile]) continue;
    std::error_code error;
    fs::remove(path(tile, round), error);
    if (error)
      return fail(Errc::unavailable,
                  fmt::format("{} cannot be removed: {}", path(tile, round).string(), error.message()));
  }
  return {};
}

}  // namespace ls::cli
