// The pages on the plugins of Mitsuba, and on the files of pbrt, glTF and Nori.
#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "formats/gltf/support_table.h"
#include "formats/nori/words.h"
#include "formats/pbrt/vocabulary.h"
#include "formats/reader/mitsuba_plugins.h"
#include "tests/unit/scene/pages/pages.h"

namespace ls::scene {
namespace {

constexpr std::string_view kGltfHead = R"(# Scenes of glTF

<!-- Made by gltf_markdown() from the table in formats/gltf/support_table.cpp; do not edit. -->

A scene file whose name ends in `.gltf` or `.glb` is read as glTF 2.0, and becomes the same scene that our XML describes: every
command takes it, and `lightshaft convert` writes it as XML. Errors name the file, the line of its JSON and the path of the value, as in
`materials[3].normalTexture`.

```
lightshaft render room.glb -D camera=Hall -o hall.exr
lightshaft render helmet.gltf -D environment=1 -o helmet.exr
```

## Conventions

- **Choices**: `-D camera=NAME` takes the camera of that name (its own, or else its node's); a scene without a camera is seen from the front,
  the right and above, so that all of it is in the frame, with a warning. `-D environment=X` adds a white sky of radiance X. A scene without
  any light is black, with a warning that says so.
- **Time**: `-D time=1.5` shows the animation at that second. In a sequence (`--frames 0-47`) frame N is N / 24 seconds later; `-D fps=X`
  takes another number than 24. Of several animations the first is seen, `-D animation=NAME` that of this name, and `-D animation=*` all.
  Nothing is blurred by motion.
- **Units**: lux, candela and candela per square metre are our irradiance, intensity and radiance: a sun of 1 lux on a white sheet, and
  an emissiveFactor of 1, are pixels of 1 / pi and 1. The picture is not scaled to be seen: a lamp of 800 candela makes a bright one.
- **Files**: images and buffers are found from the folder of the scene file; nothing is fetched from the network. Meshes, and images
  within buffers, become files, which `submit` sends along and `convert` puts beside its XML. Over HTTP the sender does that. A `.glb`
  may have 32 MiB; a larger scene is exported as a `.gltf` with several buffers of at most 32 MiB, and 64 MiB together.
- **Materials** follow what the Blender add-on makes of a Principled BSDF: with one roughness a rough coat over a diffuse base, blended with
  metal by the metallic share; with a texture of roughness, a clear coat, or a share of transmission `principled`. Transmission
  of 1 with a volume and without textures is a `dielectric`, or a `roughdielectric`. All of them keep the light that is scattered between
  facets (`multiple_scattering`).
- **Alpha**: what alphaMode cuts out or lets pass neither reflects nor gives light, unlit surfaces included.
- **Mirrors**: a node that mirrors keeps the front of its meshes in front. A camera in one looks along its axis, and its picture is not
  mirrored.
- **Sides**: surfaces are seen from both sides whatever doubleSided says. A body of glass must be closed, with its front outside. What
  gives light does so on the front only.
- **Normal maps** lean along u and to the top of the image, also where the image or its node is mirrored (`follow_mirroring`). TANGENT is
  not read.
- **Spots** fall off linearly in the angle between their two angles, with a warning; equal angles are a hard edge.
- **What has no effect** is told, once for each kind, with the path of the first: members that glTF does not define, those of the tables
  below without effect, unknown extensions. Quiet are `extras`, attributes that begin with `_`, and what the tables call needless.
- **Samples**: 64 a pixel, paths of any depth; `--spp`, `--size` and the others choose otherwise.
)";

std::string_view effect(gltf::Use use) {
  using gltf::Use;
  return use == Use::read ? "" : use == Use::ignored ? "no effect: " : "refused: ";
}

}  // namespace

std::string gltf_markdown() {
  std::string out(kGltfHead);
  out += "\n## Objects\n\n| object | members | what becomes of them |\n|---|---|---|\n";
  for (const gltf::Row& row : gltf::objects())
    out += fmt::format("| `{}` | {} | {}{} |\n", row.where, row.name, effect(row.use), row.meaning);
  out +=
      "\n## Extensions\n\nWhat is refused is an error only if the file requires it; else its fallback is "
      "read. What has no effect, or is not in "
      "this list, is a warning, and an error if the file requires it and it is not in this list.\n\n| "
      "extension | what "
      "becomes of it |\n|---|---|\n";
  for (const gltf::Row& row : gltf::extensions())
    out += fmt::format("| `{}` | {}{} |\n", row.name, effect(row.use), row.meaning);
  return out;
}

namespace {

constexpr std::string_view kMitsubaHead = R"(# Plugins of Mitsuba

<!-- Made by mitsuba_markdown() from the table in formats/reader/mitsuba_plugins.cpp; do not edit. -->

Every plugin of Mitsuba 3.9 and, marked 0.x, those that only earlier versions have; "ours" are Lightshaft's own. Their
parameters are in the [scene format](scene-format.md). What is refused is an error with its place, and this reason.

- **read**: with all parameters that change the picture. Parameters that do not are [warned of](scene-format.md#accepted-without-effect).
- **in part**: as the note says; what is left out is an error or a warning.
- **refused**: why, and what to use instead.

`bench/mitsuba_plugins.py` compares this page with an installed Mitsuba.

| element | plugin | of | here | note |
|---|---|---|---|---|
)";

std::string_view text_of(Standing standing) {
  return standing == Standing::read ? "read" : standing == Standing::in_part ? "in part" : "refused";
}
std::string_view text_of(Origin origin) {
  return origin == Origin::mitsuba3 ? "3" : origin == Origin::older ? "0.x" : "ours";
}

}  // namespace

std::string mitsuba_markdown() {
  std::string out(kMitsubaHead);
  for (const PluginRow& row : mitsuba_plugins())
    out += fmt::format("| {} | `{}` | {} | {} | {} |\n", row.tag, row.name, text_of(row.origin),
                       text_of(row.standing), row.note);
  return out;
}

namespace {

using pbrt::Row;
using pbrt::Word;

constexpr std::string_view kPbrtHead = R"(# Scenes of pbrt

<!-- Made by pbrt_markdown() from the table in formats/pbrt/vocabulary.cpp; do not edit. -->

A scene file whose name ends in `.pbrt` is read as pbrt-v4 reads it, and becomes the same scene that our XML describes:
every command takes it, and `lightshaft convert` writes it as XML. What is not in this table is an error with its place;
what is refused says what to do instead.

## Conventions

- **Files** are found from the folder of the main file. An absolute name is used as it is on the command line; a coordinator
  knows only what was sent along.
- **Meshes and grids in the text** (`trianglemesh`, `bilinearmesh`, `uniformgrid`, `rgbgrid`) are written as files, which `submit`
  sends along and `convert` puts beside its XML. Over HTTP the sender does that.
- **Camera**: pbrt has +x on the right, our sensors on the left, so `to_world` is the inverse of the transform before `Camera` times
  scale(-1, 1, 1). Coordinates of the world stay as they are. A camera that is scaled alike along all axes keeps its picture, and its
  lens is scaled. It sees from 1e-4 to 1e7 scene units. A `screenwindow` becomes a `fov` and the `principal_point_offset`, or the
  scale and place of an `orthographic` camera.
- **Colour spaces**: `rgb` values after a ColorSpace become linear sRGB by their primaries. Light keeps its X, Y, Z, so that the white
  of ACES stays a little yellow; colours of surfaces and media are adapted to the other white by Bradford's matrix, so that grey stays
  grey. What sRGB cannot hold is cut off at 0 (a reflectance at 1, too), with a warning. Images keep the space that they have
  without it, and pictures are always written in linear sRGB.
- **Light**: `rgb` is relative to the white of its colour space; a `blackbody`, a `spectrum` by pairs, and one in a file (.spd) are scaled to
  luminance 1, as in pbrt; `stdillum-D65` is white. `scale`, `power` and `illuminance` multiply that. `iso / 100` of the film
  and `shutterclose - shutteropen` of the camera multiply all light.
- **Surfaces and media**: `rgb` is linear sRGB; pairs are what the CIE observer sees of them under D65, and the same value everywhere
  is grey. So is a `blackbody`, divided by its largest value over all wavelengths. Of metals by name (`metal-Cu-eta`) Ag, Al, Au and Cu are known, as `eta` and `k`
  only. Spectra are not followed beyond red, green, blue.
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
- **Clouds** are formulas here as in pbrt: the volume `cloud` computes the same density at each point that is looked up, to float32.
- **Depth**: `maxdepth` counts scatterings; `max_depth` of ours is one more. `thindielectric` does not count here.
- **Sides**: a sphere, disk or cylinder turns its normal to the other side if it is mirrored by its transform, and once more by
  ReverseOrientation; a mesh by ReverseOrientation alone. If a mirrored sphere, disk or cylinder gives light on one side, that is a
  warning: where pbrt samples lights, it takes the other side. A mirrored `plymesh` that gives light, bounds a medium or lets light
  through is refused, as whether its file has normals decides there.
- **Motion**: cameras, shapes and instances move between their two transforms while the shutter is open. Lights and media are shown
  where they stand at StartTime, as in pbrt; so are, with a warning, shapes that give light, that stand in an ObjectBegin, or whose
  transforms shear.
- **Textures**: a `float` and a `spectrum` one may have the same name.
- **Meshes** without normals are flat, in the text and in files.
- **Texture coordinates** are those of pbrt: on spheres v is 1 at +z, for which a sphere with a texture is mirrored along its axis; a
  patch without any goes from (0, 0) to (1, 1); a triangle without any has (0, 0), (1, 0) and (1, 1). Two differ: on a `disk` u is the distance from the centre
  and v the angle, which is a warning, and a `plymesh` whose file has none is laid out by its triangles otherwise.
- **The filter** is a Gaussian of sigma 0.5, cut off at 4 sigma; pbrt cuts it off at radius 1.5.
- **Parameters without an effect** here are warnings that name them, one for each kind of object. A refused parameter may be given with
  its default value.
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

namespace ls::scene::nori {
namespace {

constexpr std::string_view kIntroduction = R"(## Files of Nori

A `<scene>` that has a `<camera>` or a `<mesh>`, and if it has a version neither a `<shape>` nor a `<sensor>`, is a scene of Nori (or of a renderer that descends from it, such
as Kombu). It becomes the same scene as one of Mitsuba that means the same, with the same digest; `lightshaft convert` shows which.
What Nori means otherwise than Mitsuba:

- A `<mesh>` may be called `<shape>`, as some descendants of Nori do.
- Every object stands where it is used; numbers are separated by commas or blanks; names are in camelCase.
- The camera's +x is on the right of the picture, so that a bare `<lookat>` shows the world mirrored. `fov` is over the width. The
  filter, if none is given, is `gaussian` with stddev 0.5; one sample a pixel is taken if there is no sampler.
- v of a mesh runs from the lower edge of an image upwards. On a sphere u begins at -x.
- A mesh whose file has no normals (`vn`) is flat; in Mitsuba it is smooth.
- A mesh without a bsdf is diffuse with albedo 0.5, also if it shines; if it bounds a medium it lets light through.
- A `<medium>` in a mesh is inside of it. One that stands in the scene itself is everywhere where no mesh holds another.
- Media come in three notations: `sigma_a`, `sigma_s` with `phase_g`, `density_scale` and `emission`; `sigma_t`, `albedo`, `scale`;
  `absorption`, `scattering`.
- A `<test type="ttest">` or `"chi2test">` holds scenes or bsdfs and what is expected of them; `lightshaft validate FILE` runs it.

)";

constexpr std::string_view kIntegratorParameters = R"(
`direct` and its kin show lamps, and the light that reaches a surface straight from them; mirrors and clear glass show lamps and
nothing else, also with `direct_ems`. `whitted` follows mirrors and clear glass until they show another surface. Nori ends one in
twenty such paths and weighs the others up, which changes no mean; here a path ends at random once it carries little light.

Those without a max_depth take `maxDepth` (-1: no limit), those with media `inmedium` (the camera is in the medium of the mesh around
it), `volpath_distant_mis` its `distance` and `heuristic` as in Mitsuba's language.
)";

}  // namespace

std::string markdown() {
  std::string out(kIntroduction);
  out += "| object of Nori | means here |\n|---|---|\n";
  for (const Plugin& p : plugins()) out += fmt::format("| {} `{}` | {} |\n", p.tag, p.type, p.becomes);
  out += "\n| parameter | of | given as | default | meaning |\n|---|---|---|---|---|\n";
  for (const Plugin& p : plugins())
    for (const Parameter& q : p.parameters)
      out += fmt::format("| `{}` | {} `{}` | `{}` | {} | {} |\n", q.name, p.tag, p.type, text_of(q.types),
                         q.fallback,
                         q.idle.empty() ? std::string(q.meaning) : fmt::format("no effect: {}", q.idle));
  out += "\nIts integrators:\n\n| name | means |\n|---|---|\n";
  for (const IntegratorRow& row : integrators())
    out += fmt::format("| `{}` | `{}`{}{} |\n", row.name, row.ours,
                       row.max_depth ? fmt::format(" with max_depth {}", *row.max_depth) : "",
                       row.but.empty() ? "" : fmt::format(", with a warning: {}", row.but));
  out += kIntegratorParameters;
  out += "\nRefused by name:\n\n| object | why |\n|---|---|\n";
  for (const Refused& r : refused_plugins())
    out += fmt::format("| {} `{}` | {} |\n", r.tag, r.type, r.because);
  return out + "\n";
}

}  // namespace ls::scene::nori
