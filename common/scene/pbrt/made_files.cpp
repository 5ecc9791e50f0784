// Makes files from the numbers in a scene's text.
#include "common/scene/made_files.h"

#include "common/scene/pbrt/object_translation.h"

namespace ls::scene::pbrt {
namespace {

std::string name_of(Translation& t, const Span& at, Result<std::string> kept) {
  if (kept) return std::move(*kept);
  t.report.error(at, kept.error().message);
  return {};
}

}  // namespace

std::string keep_mesh(Translation& t, const Span& at, const Mesh& mesh) {
  const auto single = [](const std::vector<double>& all) {
    return std::vector<float>(all.begin(), all.end());
  };
  MadeMesh made;
  made.positions = single(mesh.positions);
  made.normals = single(mesh.normals);
  made.uvs = single(mesh.uvs);
  made.indices.assign(mesh.indices.begin(), mesh.indices.end());
  return name_of(t, at, keep_made(t.assets, made));
}

std::string keep_grid(Translation& t, const Span& at, const MadeGrid& grid) {
  return name_of(t, at, keep_made(t.assets, grid));
}

}  // namespace ls::scene::pbrt
