#include "cli/commands/converted.h"

#include <fmt/format.h>

#include <map>
#include <set>

#include "common/scene/json/serialize.h"
#include "common/scene/reader/xml_write.h"

namespace ls::cli {
namespace {

namespace fs = std::filesystem;

// Finds only the assets of a scene that has already been read.
class KnownAssets final : public AssetSource {
 public:
  explicit KnownAssets(const Scene& scene) {
    for (const Asset& a : scene.assets) assets_.emplace(a.name, a);
  }
  Result<Asset> find(std::string_view name) override {
    if (const auto it = assets_.find(name); it != assets_.end()) return it->second;
    return fail(Errc::not_found, fmt::format("there is no file \"{}\"", name));
  }
  Result<std::string> text(std::string_view name) override {
    return fail(Errc::not_found, fmt::format("nothing includes \"{}\"", name));
  }

 private:
  std::map<std::string, Asset, std::less<>> assets_;
};

fs::path folder_of(const fs::path& file) {
  std::error_code error;
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const fs::path real = fs::weakly_canonical(folder, error);
  return error ? folder : real;
}

bool leads_out(const std::string& name) {
  return name.starts_with('/') || name == ".." || name.starts_with("../");
}

// Gives assets whose names lead out of the new folder names within it, which differ from all others.
void rename_those_outside(Scene& scene) {
  std::set<std::string> taken;
  for (const Asset& a : scene.assets)
    if (!leads_out(a.name)) taken.insert(a.name);
  for (Asset& a : scene.assets) {
    if (!leads_out(a.name)) continue;
    std::string name = fs::path(a.name).filename().string();
    if (!taken.insert(name).second) {
      name = a.digest.hex().substr(0, 12) + "-" + name;
      taken.insert(name);
    }
    a.name = std::move(name);
  }
}

Result<std::vector<FileCopy>> copies_for(const LocalScene& scene, const Scene& written,
                                         const fs::path& folder) {
  std::vector<FileCopy> copies;
  std::set<fs::path> planned;
  for (std::size_t i = 0; i < written.assets.size(); ++i) {
    const std::string& before = scene.scene.assets[i].name;
    const auto file = scene.files.find(before);
    if (file == scene.files.end())
      return fail(Errc::internal, fmt::format("it is not known where {} is", before));
    const fs::path to = folder / written.assets[i].name;
    std::error_code error;
    if (!planned.insert(to).second) continue;
    if (!fs::exists(to, error)) {
      copies.push_back(
          {before, file->second.path, to, file->second.digest, before != written.assets[i].name});
      continue;
    }
    const auto there = sha256_file(to);
    if (!there || *there != file->second.digest)
      return fail(Errc::already_exists,
                  fmt::format("{} is there already, and is not the scene's {}: choose another folder for OUT",
                              to.string(), before));
  }
  return copies;
}

}  // namespace

Result<Converted> convert_scene(const LocalScene& scene, const fs::path& out) {
  Scene written = scene.scene;
  Converted converted;
  const fs::path folder = folder_of(out);
  if (folder != folder_of(scene.name)) {
    rename_those_outside(written);
    auto copies = copies_for(scene, written, folder);
    if (!copies) return tl::unexpected(copies.error());
    converted.copies = std::move(*copies);
  }
  converted.text = write_xml(written);
  converted.digest = digest_of(written);
  KnownAssets assets(written);
  const ReadResult again = read_scene(out.filename().string(), converted.text, assets);
  if (!again.scene || digest_of(*again.scene) != converted.digest)
    return fail(
        Errc::internal,
        fmt::format(
            "{} cannot be written as XML that reads back to the same scene; nothing was written. This "
            "is a fault of this program: please report it with the scene. {}",
            scene.name, format_diagnostics(again.diagnostics)));
  return converted;
}

Result<void> copy_beside(const FileCopy& copy) {
  std::error_code error;
  fs::create_directories(copy.to.parent_path(), error);
  const fs::path aside = copy.to.string() + ".part";
  if (!error) fs::copy_file(copy.from, aside, fs::copy_options::overwrite_existing, error);
  if (!error) fs::rename(aside, copy.to, error);
  if (!error) return {};
  std::error_code ignored;
  fs::remove(aside, ignored);
  return fail(Errc::unavailable, fmt::format("{} cannot be copied to {}: {}", copy.from.string(),
                                             copy.to.string(), error.message()));
}

}  // namespace ls::cli
