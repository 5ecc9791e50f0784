#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "common/scene/pbrt/vocabulary.h"
#include "tests/unit/scene/pages/pages.h"

namespace ls::scene {
namespace {

using pbrt::Row;
using pbrt::Word;

constexpr std::string_view kPbrtHead = R"(# Scenes of pbrt

<!-- Made by pbrt_markdown() from the table in common/scene/pbrt/vocabulary.cpp; do not edit. -->

A scene file whose name ends in `.pbrt` is read as pbrt-v4 reads it, and becomes the same scene that our XML describes:
every command takes it, and `lightshaft convert` writes it as XML. What is not in this table is an error with its place;
what is refused says what to do instead.

## Conventions

- **Files** are found from the folder of the main file. An absolute name is used as it is on the command line; a coordinator
  knows only what was sent along.
- **Meshes and grids in the text** (`trianglemesh`, `bilinearmesh`, `uniformgrid`, `rgbgrid`, `cloud`) are written as files, which `submit`
  sends along and `convert` puts beside its XML. Over HTTP the sender does that.
- **Camera**: pbrt has +x on the right, our sensors on the left, so `to_world` is the inverse of the transform before `Camera` times
  scale(-1, 1, 1). Coordinates of the world stay as they are. A camera that is scaled alike along all axes keeps its picture, and its
  lens is scaled. It sees from 1e-4 to 1e7 scene units.
- **Light**: `rgb` is relative to the white of sRGB; a `blackbody`, a `spectrum` by pairs, and one in a file (.spd) are scaled to
  luminance 1, as in pbrt; `stdillum-D65` is white. `scale`, `power` and `illuminance` multiply that. `iso / 100` of the film
  and `shutterclose - shutteropen` of the camera multiply all light.
- **Surfaces and media**: `rgb` is linear sRGB; pairs are what the CIE observer sees of them under D65, and the same value everywhere
  is grey. Metals by name are those of [the scene format](scene-format.md#names). Spectra are not followed beyond red, green, blue.
- **Roughness**: `remaproughness` is true by default, and alpha then the square root of the roughness; the distribution is GGX.
- **Grids** in the text lie at the centres of their voxels and fade to 0 in the outermost half voxel, as in pbrt: the file has a layer
  of zeros around them, which is the `border` of the volume.
- **Light of media** is sigma_a times Le in pbrt, where sigma_a is that at the point, with its density and `scale`. Black bodies of
  `temperature` have kelvin (value - temperatureoffset) * temperaturescale; the spectrum of each is divided by its largest value
  (`peak_one` of ours) and not scaled to luminance 1, so that a body's luminance is the integral of the CIE observer's y with that
  spectrum, over nm: 106.857 times what `peak_one` gives, which is the factor that `emission_scale` has. Exact are the map of
  temperatures, the interpolation of grids, and black bodies as the CIE observer sees them (1e-4); colours outside of sRGB are cut
  off at 0. pbrt renders bodies from 100 K on, this program from 200 K; light in between is below 1e-27 of the peak.
- **Spectra of media**: sigma_a, sigma_s and Le are red, green and blue here. Where extinction differs by wavelength within one of
  them, pbrt's colours of thick media differ.
- **Rgbgrid**: if the albedo is the same in all voxels, the medium is that of pbrt. If it differs, it is interpolated between voxels,
  where pbrt interpolates absorption and scattering: a warning says so, and values at the centres of voxels are the same.
- **Clouds** by formula become a grid from face to face of their box, of 4 nodes along a cell of their finest noise: of frequency times
  15.7 cells per unit or, with wispiness, 19.9. One grid has at most 2^24 nodes, those of a file 2^25: a finer cloud gets fewer
  nodes a cell, with a warning, and is refused below 2.
- **Depth**: `maxdepth` counts scatterings; `max_depth` of ours is one more. `thindielectric` does not count here.
- **Sides**: a shape that gives light, bounds a medium or lets light through, and is mirrored by its transform, is refused unless it is a
  mesh without normals in the text: which way its normal points is not the same everywhere in pbrt itself.
- **Meshes** without normals are flat, in the text and in files.
- **Texture coordinates** are those of pbrt: on spheres v is 1 at +z, for which a sphere with a texture is mirrored along its axis; a
  patch goes from (0, 0) to (1, 1); a triangle without any has (0, 0), (1, 0) and (1, 1). Two differ: on a `disk` u is the distance from the centre
  and v the angle, which is a warning, and a `plymesh` whose file has none is laid out by its triangles otherwise.
- **The filter** is a Gaussian of sigma 0.5, cut off at 4 sigma; pbrt cuts it off at radius 1.5.
)";

// Escapes "|", which would end a table's cell.
std::string cell(std::string_view text) {
  std::string out(text);
  for (std::size_t i = out.find('|'); i != std::string::npos; i = out.find('|', i + 4))
    out.replace(i, 1, " or ");
  return out;
}

std::string name_of(const Row& row) { return fmt::format("`{} \"{}\"`", row.directive, row.type); }

std::string parameters(const Row& row) {
  std::string out;
  for (const Word& w : row.words) {
    const std::string_view effect = w.use == Word::Use::refused   ? "refused: "
                                    : w.use == Word::Use::ignored ? "no effect: "
                                                                  : "";
    out += fmt::format("| `{}` | {} | {} | {}{} |\n", w.name, cell(w.types), w.fallback, effect, w.meaning);
  }
  return out.empty() ? "No parameters.\n"
                     : "| parameter | type | default | meaning |\n|---|---|---|---|\n" + out;
}

bool same_words(const Row& a, const Row& b) {
  const auto key = [](const Word& w) { return std::tuple(w.name, w.types, w.fallback, w.meaning, w.use); };
  return std::equal(a.words.begin(), a.words.end(), b.words.begin(), b.words.end(),
                    [&](const Word& x, const Word& y) { return key(x) == key(y); });
}

}  // namespace

std::string pbrt_markdown() {
  std::string out(kPbrtHead);
  out += "\n## Directives\n\n| directive | what it does |\n|---|---|\n";
  for (const auto& d : pbrt::plain_directives()) out += fmt::format("| `{}` | {} |\n", d.name, d.meaning);
  out += "\n## Objects that are read\n";
  const auto rows = pbrt::rows();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    if (!row.is_read) continue;
    out += fmt::format("\n**{}**: {}.\n", name_of(row), row.meaning);
    const bool repeats = i + 1 < rows.size() && rows[i + 1].is_read &&
                         rows[i + 1].directive == row.directive && same_words(row, rows[i + 1]);
    if (!repeats) out += "\n" + parameters(row);
  }
  out += "\n## Objects that are refused\n\n| object | why, and what to do |\n|---|---|\n";
  for (const Row& row : rows)
    if (!row.is_read) out += fmt::format("| {} | {} |\n", name_of(row), row.meaning);
  return out;
}

}  // namespace ls::scene
