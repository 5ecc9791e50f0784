// lightshaft convert: writes any scene as canonical Mitsuba 3 XML, with its files beside it.
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "cli/commands/commands.h"
#include "cli/local/local_scene.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "core/assets/mesh.h"
#include "core/scene/json/serialize.h"
#include "formats/reader/xml_write.h"

namespace ls::cli {
namespace {

struct ConvertFlags {
  std::string in, out;
  std::vector<std::string> defines;
  bool strict = false, quiet = false;
};

namespace fs = std::filesystem;

struct FileCopy {
  std::string name_before;  // the file's name in the original scene
  std::filesystem::path from, to;
  Digest digest;
  bool renamed = false;
};

// A scene as canonical XML.
struct Converted {
  std::string text;
  std::vector<std::string> only_ours;  // what Mitsuba 3 does not read of the text
  Digest digest;                       // digest of the scene that the text describes
  std::vector<FileCopy> copies;        // files to copy beside the XML file
};

// Provides the assets of a scene that was already read, by name, without opening files. The converted text is
// read with it.
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

// Renames each asset whose name leads out of the scene's folder (an absolute path, or a path that begins with
// ".."), so that its copy lies in the new folder. The new name is the file name without folders, made unique.
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

// Mitsuba smooths meshes whose files have no normals, where Nori and pbrt shade them flat
// (MeshShape::flat_without_normals). With the files at hand this is said in Mitsuba's words, by
// `face_normals`; the image is the same. A mesh whose file cannot be read stays as it is.
void mark_flat_meshes(const LocalScene& scene, Scene& written) {
  for (std::size_t i = 0; i < written.shapes.size(); ++i) {
    auto* mesh = std::get_if<MeshShape>(&written.shapes[i].geometry);
    if (!mesh || !mesh->flat_without_normals) continue;
    const std::string& name = scene.scene.assets[mesh->file.value].name;
    const auto file = scene.files.find(name);
    if (file == scene.files.end()) continue;
    const auto loaded = load_mesh(file->second.path, name, mesh->shape_index);
    if (!loaded) continue;
    mesh->flat_without_normals = false;
    mesh->face_normals = mesh->face_normals || loaded->normals.empty();
  }
}

// Returns the files to copy into `folder` for `written`, the scene after its assets were renamed. A file that
// already exists there with the same content is left out. If `all` is false, only temporary files are copied,
// which were made from data in the scene's text when it was read. already_exists: `folder` has a different
// file with the name of a copy.
Result<std::vector<FileCopy>> copies_for(const LocalScene& scene, const Scene& written,
                                         const fs::path& folder, bool all) {
  std::vector<FileCopy> copies;
  std::set<fs::path> planned;
  for (std::size_t i = 0; i < written.assets.size(); ++i) {
    const std::string& before = scene.scene.assets[i].name;
    const auto file = scene.files.find(before);
    if (file == scene.files.end())
      return fail(Errc::internal, fmt::format("it is not known where {} is", before));
    if (!all && !file->second.is_made) continue;
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
                  fmt::format("{} exists and differs from the scene's {}: choose another folder for OUT",
                              to.string(), before));
  }
  return copies;
}

// Converts a scene to the text of the file `out`, and lists the files to copy beside it. If `out` is in the
// folder of the original scene, these are only temporary files that were made from data in the scene's text
// when it was read. Otherwise they are all files that the scene needs, with the same relative names; a file
// whose name is absolute or begins with ".." goes directly into the folder of `out`. The new text is read
// again and compared with the scene. internal: the new text describes another scene; already_exists: the
// folder has another file under a name that the scene needs.
Result<Converted> convert_scene(const LocalScene& scene, const fs::path& out) {
  Scene written = scene.scene;
  Converted converted;
  const fs::path folder = folder_of(out);
  const bool other_folder = folder != folder_of(scene.name);
  if (other_folder) rename_those_outside(written);
  mark_flat_meshes(scene, written);
  auto copies = copies_for(scene, written, folder, other_folder);
  if (!copies) return tl::unexpected(copies.error());
  converted.copies = std::move(*copies);
  WrittenScene xml = write_scene(written);
  converted.text = std::move(xml.text);
  converted.only_ours = std::move(xml.only_ours);
  converted.digest = digest_of(written);
  KnownAssets assets(written);
  const ReadResult again = read_scene(out.filename().string(), converted.text, assets);
  if (!again.scene || digest_of(*again.scene) != converted.digest)
    return fail(Errc::internal, fmt::format("{} cannot be written as XML of the same scene, so nothing was "
                                            "written. This is a bug: please report it with the scene. {}",
                                            scene.name, format_diagnostics(again.diagnostics)));
  return converted;
}

// Copies a file to its place beside the converted scene, completely or not at all; creates missing folders.
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

int run(const ConvertFlags& flags) {
  const auto defines = parse_defines(flags.defines);
  if (!defines) return print_error(defines.error());
  if (const auto ok = check_output("OUT", flags.out); !ok) return print_error(ok.error());
  std::error_code error;
  if (std::filesystem::equivalent(flags.in, flags.out, error))
    return usage_error(fmt::format("OUT {} is the scene itself: choose another OUT", flags.in));
  const auto scene = read_local_scene(flags.in, *defines, flags.strict);
  if (!scene) return print_rejected(scene.error());
  print_diagnostics(scene->warnings);
  const auto converted = convert_scene(*scene, flags.out);
  if (!converted) return print_error(converted.error());
  for (const FileCopy& copy : converted->copies) {
    if (!flags.quiet && copy.renamed)
      print_note(fmt::format("{} is renamed to {}", copy.name_before, copy.to.string()));
    if (const auto done = copy_beside(copy); !done) return print_error(done.error());
  }
  if (const auto written = write_output(flags.out, converted->text); !written)
    return print_error(written.error());
  if (!converted->only_ours.empty())
    print_note(fmt::format("warning: only Lightshaft reads {}; Mitsuba 3 refuses {}",
                           fmt::join(converted->only_ours, ", "), flags.out));
  print(fmt::format("scene_sha256 {}", converted->digest.hex()));
  return kOk;
}

}  // namespace

void add_convert(CLI::App& app, Action& action) {
  const auto [convert, flags] = add_command<ConvertFlags>(
      app, action, "convert",
      "write a scene as canonical Mitsuba 3 XML. Its files are copied to OUT's folder under the names that "
      "the scene uses, unless they exist; files that would be outside of the folder get names inside. Prints "
      "the digest of OUT, which is that of the scene unless a file was renamed or a mesh without normals, "
      "which "
      "Nori and pbrt shade flat, had to be marked so",
      run);
  add_option(*convert, "in", flags->in, "IN", "the scene")->required();
  add_option(*convert, "out", flags->out, "OUT", "the XML file to write")->required();
  add_defines(*convert, flags->defines);
  convert->add_flag("--strict", flags->strict, "treat warnings as errors");
  convert->add_flag("--quiet", flags->quiet, "print only the digest, warnings and errors");
}

}  // namespace ls::cli
