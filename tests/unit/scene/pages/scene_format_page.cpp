#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>
#include <cmath>

#include "core/scene/schema/describe_fields.h"
#include "core/scene/schema/integrators.h"
#include "core/scene/schema/materials.h"
#include "formats/reader/unsupported.h"
#include "formats/reader/upgrade.h"
#include "tests/unit/scene/pages/pages.h"

namespace ls::scene {
namespace {

std::string text_of(const std::array<double, 3>& v) {
  return v[0] == v[1] && v[1] == v[2] ? fmt::format("{}", v[0]) : fmt::format("{}, {}, {}", v[0], v[1], v[2]);
}

// The texts of two columns for a parameter: the type of its element in a file, and its default.
struct Column {
  std::string_view type;
  std::string value;
};
Column column(const Field&, double x) { return {"float", fmt::format("{}", x)}; }
Column column(const Field&, int x) { return {"integer", fmt::format("{}", x)}; }
Column column(const Field&, std::uint64_t x) { return {"integer", fmt::format("{}", x)}; }
Column column(const Field&, bool x) { return {"boolean", x ? "true" : "false"}; }
Column column(const Field&, const std::string& x) {
  return {"string", x.empty() ? "" : fmt::format("\"{}\"", x)};
}
Column column(const Field& f, const Rgb& x) { return {f.constvolume ? "rgb, volume" : "rgb", text_of(x)}; }
Column column(const Field&, const std::vector<double>&) { return {"string of numbers", ""}; }
Column column(const Field&, const Vec3& x) { return {"point, vector", text_of(x)}; }
Column column(const Field&, const Transform&) { return {"transform", "identity"}; }
Column column(const Field&, const UvTransform&) { return {"transform", "identity"}; }
Column column(const Field&, AssetIndex) { return {"string", ""}; }
Column column(const Field& f, TextureIndex) { return {"rgb, texture", text_of(f.fallback)}; }
Column column(const Field&, const std::optional<TextureIndex>&) { return {"texture", "none"}; }
Column column(const Field& f, VolumeIndex) { return {"rgb, volume", text_of(f.fallback)}; }
Column column(const Field&, const std::optional<VolumeIndex>&) { return {"rgb, volume", "none"}; }
template <class E>
requires std::is_enum_v<E> Column column(const Field&, E x) {
  std::string all;
  for (const auto& [name, value] : NamesOf<E>::all)
    all += fmt::format("{}{}", all.empty() ? "" : ", ",
                       value == x ? fmt::format("**{}**", name) : std::string(name));
  return {"string", all};
}
// For nested objects and derived fields.
template <class T>
requires(!std::is_enum_v<T>) Column column(const Field&, const T&) { return {"", ""}; }

std::string range_of(const Field& f) {
  const std::string low =
      std::isinf(f.range.min) ? "" : fmt::format("{} {}", f.range.open_min ? ">" : "≥", f.range.min);
  const std::string high =
      std::isinf(f.range.max) ? "" : fmt::format("{} {}", f.range.open_max ? "<" : "≤", f.range.max);
  return low.empty() || high.empty() ? low + high : fmt::format("{}, {}", low, high);
}

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}
// Returns the beginning of a parameter's description if only some integrators have it.
std::string integrators_of(const Field& f) {
  if (f.only_of[0].empty()) return {};
  if (f.only_of[1].empty()) return fmt::format("`{}` alone: ", f.only_of[0]);
  return fmt::format("`{}` and `{}` alone: ", f.only_of[0], f.only_of[1]);
}

class Rows {
 public:
  template <class T>
  void field(const Field& f, const T& value) {
    if (f.derived && f.given_as.empty()) return;
    const bool nameless = f.given_as.starts_with('<');
    const Column c = column(f, value);
    std::string given(nameless ? "nested" : f.given_as.empty() ? c.type : f.given_as);
    if (f.named_ior) given += ", string";
    text_ += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", nameless ? f.given_as : f.name, given,
                         f.required  ? "needed"
                         : f.derived ? ""
                                     : c.value,
                         f.unit, range_of(f), integrators_of(f) + std::string(f.doc));
  }
  std::string take() const {
    return text_.empty() ? "No parameters.\n\n"
                         : fmt::format(
                               "| parameter | given as | default | unit | range | meaning "
                               "|\n|---|---|---|---|---|---|\n{}\n",
                               text_);
  }

 private:
  std::string text_;
};

std::string sentence(std::string_view text) {
  std::string out = fmt::format("{}.", text);
  out[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(out[0])));
  return out;
}

template <class T>
void add_type(std::string& out) {
  const TypeInfo& info = kInfo<T>;
  const std::string plugins(info.plugins.empty() ? info.name : info.plugins);
  out += fmt::format("### {} `{}`\n\n{}\n\n", info.kind,
                     replaced(replaced(plugins, "; ", ", "), ", ", "`, `"), sentence(info.doc));
  Rows rows;
  const T value{};
  describe(rows, value);
  out += rows.take();
}
template <class... Ts>
void add_types(std::string& out, const std::variant<Ts...>*) {
  (add_type<Ts>(out), ...);
}
template <class V>
void add_variant(std::string& out, std::string_view title) {
  out += fmt::format("## {}\n\n", title);
  add_types(out, static_cast<const V*>(nullptr));
}

constexpr std::string_view kPreamble = R"(# Scene format

<!-- Made by scene_format_markdown() from the table in core/scene/schema/describe_fields.h; do not edit. -->

Scenes are Mitsuba 3 XML files, with Mitsuba's meaning and defaults. What a parameter is called, what it may be and what it is
if it is not given stands below: this page is made from the same table that reads the files. Lengths are scene units, angles
degrees, colours linear RGB.

What is not known is an error with a place and a suggestion, never skipped. A parameter that the dialect has but that means
nothing here is a warning that names it; `--strict` makes warnings errors. Up to 20 are told at once.

```
bath.xml:14:16: error: medium "homogeneous" has no parameter 'sigmat'; did you mean 'sigma_t'?
  14 |     <float name="sigmat" value="2"/>
     |                  ^~~~~~
```

A whole scene, a ball of fog in a white surrounding:

```xml
<scene version="3.0.0">
  <default name="density" value="2"/>
  <integrator type="volpath"/>
  <medium type="homogeneous" id="fog">
    <float name="sigma_t" value="$density"/>
    <rgb name="albedo" value="0.9 0.95 0.99"/>
    <phase type="hg"><float name="g" value="0.6"/></phase>
  </medium>
  <shape type="sphere">
    <bsdf type="null"/>
    <ref name="interior" id="fog"/>
  </shape>
  <emitter type="constant"/>
  <sensor type="perspective">
    <float name="fov" value="35"/>
    <transform name="to_world"><lookat origin="0 1 -4" target="0 0 0" up="0 1 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="64"/></sampler>
    <film type="hdrfilm"><integer name="width" value="320"/><integer name="height" value="240"/></film>
  </sensor>
</scene>
```

## Notation

- Values: `<float>`, `<integer>`, `<boolean>`, `<string>`, `<rgb>`, `<spectrum>`, `<vector>`, `<point>`, each with `name` and
  `value`; vectors and points also by `x`, `y`, `z`. Numbers are separated by commas or blanks. A colour is one number (grey), three,
  or `#rrggbb` (8-bit sRGB). Where the tables say rgb, `<float>`, `<color>` and `<spectrum>` will do, too.
- `<spectrum value="400:0.1, 500:0.3, 700:0.9"/>` is a curve over wavelengths in nm, with straight lines between its points and 0
  beyond its ends. It becomes the linear sRGB that the CIE 1931 2-degree observer sees: of light as it is, of anything else under
  D65. What sRGB or a reflectance can't hold is cut off, with a warning. `<spectrum value="2"/>` of an emitter is light of the same
  power at all wavelengths, which is 2 * (1.2048, 0.9483, 0.9089), as in Mitsuba's RGB modes; elsewhere it is grey.
- A spectrum may be an object, too: `<spectrum type="irregular">` with `wavelengths` and `values` (a `<string>` of numbers each) and
  `regular` with `wavelength_min`, `wavelength_max` and `values` are such curves; `d65` is white, `color` times `scale`; `blackbody`
  with `temperature` is light of a black body, in the units of a medium's ([below](#grids-and-light-given-off-by-media));
  `rawconstant` has a `value`: a number or a `<vector>`.
- `<transform name="to_world">` holds `<translate>`, `<rotate>`, `<scale>`, `<lookat>`, `<matrix>` (9 or 16 numbers, row by row),
  each applied after those before it. `<rotate>` turns by `angle` degrees about the direction `x`, `y`, `z`; if that is not of
  length 1 there is a warning, as Mitsuba 3 then shears.
- Where one number is wanted (a roughness, an opacity, the weight of a blend, all of `principled` but its colour) a coloured texture
  gives its luminance; of a `checkerboard`, color1 then stands where its color0 would, as in Mitsuba 3.
- `nested` in a table: an element of this kind stands inside, with no name needed. Where a kind such as texture or medium is
  listed for a parameter, the element (or a `<ref>`) carries the parameter's name: `<ref name="interior" id="fog"/>`.
- Objects have a `type`, and may have an `id`; `<ref id="..."/>` stands for the object, wherever it is defined. `<alias id="old"
  as="new"/>` gives it another id.
- `$name` in any attribute is replaced by the value of `-D name=value` or, if that is not given, of `<default name="name"
  value="..."/>` before it. A `-D` that nothing in the scene asks for is a warning over HTTP and an error on the command line.
- `<include filename="..."/>` puts in the objects of another file, `<path value="folder"/>` adds a folder in which files are
  looked for. Names are relative to the main scene file, those in an included file first to the folder of that file.
- Which plugins of Mitsuba are read, and why the others are refused: [plugins of Mitsuba](mitsuba.md).
- Files of version 0.x are read as Mitsuba 0.5 and 0.6 do, files of Nori as Nori does: see their sections.

)";

constexpr std::string_view kOldFiles[] = {
    R"(## Files of version 0.x

Names may be in camelCase: `toWorld` is `to_world`, `intIOR` is `int_ior`, `<lookAt>` is `<lookat>`. Some parameters have new names
besides:

| object | 0.x | here |
|---|---|---|
)",
    R"(
What else such files mean:

- A shape without a bsdf that bounds a medium lets light through (`null`), unless it emits light.
- `homogeneous` takes `sigmaA` and `sigmaS`, or `sigmaT` and `albedo`; `heterogeneous` takes `density` and `albedo`. A constant
  density is everywhere.
- A `gridvolume` is placed by the box in its file, with the outermost values on the faces of the box (`use_grid_bbox` and
  `node_centred` are true).
- `conductor` and `roughconductor` are copper unless they say otherwise.
- A curve in a `<spectrum>` is seen as it is, whatever it is for; a single number is grey. `<rgb value="#..."/>` is linear,
  `<srgb>` is not.
- Textures: `uscale`, `vscale`, `uoffset`, `voffset` give u * uscale + uoffset; `gamma` 1 is `raw`; the filters `trilinear` and `ewa`
  are `bilinear`.
- A `checkerboard` that gives a number has its color0 where it has it as a colour.
- `normalmap` and `bumpmap` neither flip normals nor cast shadows unless they say so.
- A film "mfilm" is of one pixel with a box filter unless it says otherwise.

)"};

constexpr std::string_view kCanonical = R"(## Canonical form

A scene that was read travels as canonical JSON: every field written, keys sorted, numbers in the shortest form that reads back
to the same bits, files named by SHA-256. Objects that nothing uses are left out. The SHA-256 of this text is the scene's digest.

## Grids and light given off by media

- What a file is follows from its name. A grid of an OpenVDB or NanoVDB file is placed by the file's own transform, then by
  `to_world`; the volumes of a medium may name several grids of one file, each by its `grid_name`. Grids of one number a voxel or
  three are read (of OpenVDB float, double, vec3s, vec3d; of NanoVDB, ABI 32: float, double, vec3f, vec3d, half, Fp4, Fp8, Fp16,
  FpN; plain, zlib or Blosc); level sets, staggered flows, points and whole numbers are refused.
- A grid takes memory for what is in it: where it is empty or constant, next to none, and for values that are all exact as half
  floats, as those of files of half floats are, two bytes each instead of four. Pixels don't depend on it, save for the noise of boxes of more than 4 million macro cells. A grid may take 16 GiB
  and, if it is of OpenVDB or NanoVDB, span 16384 voxels along each axis. `lightshaft inspect SCENE --json` tells the bytes.
- Three numbers a voxel (of a `.vol`, too) are of red, green and blue: as a `sigma_t` each channel has a density of its own, as in
  Mitsuba's RGB modes. Where all three are the same everywhere the medium is grey, and renders as one of a single channel.
- A `.bin` file is int32 nx, ny, nz; float32 minimum x, y, z and maximum x, y, z of its box; nx ny nz values of float32; all little
  endian and nothing else. The outermost values lie on the faces of the box, in scene units, which `to_world` then moves. `order`
  says whether x or z runs fastest.
- A `heterogeneous` medium gives off light by one of `emission` (radiance per length), `source_radiance` (sigma_a times it) and
  `temperature` (sigma_a times the radiance of a black body). A black body of spectral radiance 1 W/(m^2 sr nm) at all wavelengths
  would have luminance 1: at 1500 K it is (0.35, 0.046, 0), at 6500 K (4.4e4, 4.1e4, 4.4e4); `emission_scale` brings it to
  the scene's units. With `peak_one` the spectrum of each body is divided by its largest value, so that its colour stays and its
  brightness is that of a body whose spectrum reaches 1. `emission_weight` is a factor on it that varies in space, a grid of one
  number a voxel or a colour. Colours outside of sRGB are cut off at 0. Such light counts like that of an emitter that a path meets:
  `max_depth` 1 shows it, `hide_emitters` hides it where the camera looks straight at it. It lights the scene where paths come by:
  next-event estimation does not look for it.

## Volumes without a file

- `noise`, `cloud`, `product` and `remap` are computed at each point that is looked up, with no resolution of their own. They stand
  wherever a grid may: as a density, an albedo, a light given off, a temperature, the weight of a `blendphase`. Each has one
  channel; the `tint` of the medium gives a density its colour.
- As a density a volume ends at its box: that of a `noise` or a `cloud` from `min` to `max`, moved by `to_world`; of a `remap` that
  of the volume within; of a `product` that of its first volume that has one. A light given off ends there too. As an albedo or a
  weight, and within a `product`, a `noise` or a `cloud` is everywhere, a grid 0 beyond its box.
- A `heightfog` has no box. As the `sigma_t` of a medium it fills all that the medium fills: a shape, or everything around the camera
  and without an end, if the sensor names the medium. The albedo of such a medium and the light that it gives off (`source_radiance`
  or `temperature`) are the same everywhere. Where they have to vary, or the fog has to have holes, make it a `product` with a
  volume that has a box. Higher up than some 700 times `height` there is no fog left that double could tell.
- Exponential fog that goes on below the ground, as some programs have it, is one whose ground is at the lowest point of the scene,
  with the density there.

```xml
<medium type="heterogeneous" id="morning">
  <volume name="sigma_t" type="product">
    <volume name="first" type="noise">
      <float name="scale" value="0.5"/> <integer name="octaves" value="5"/> <float name="low" value="-0.5"/> <float name="high" value="1.5"/>
      <point name="min" x="-20" y="0" z="-20"/> <point name="max" x="20" y="8" z="20"/>
    </volume>
    <volume name="second" type="heightfog"> <float name="value" value="0.4"/> <float name="height" value="1.5"/> </volume>
  </volume>
</medium>
```

## Boundaries of media

- Where boundaries neither touch nor hold each other the rule is Mitsuba's: light that leaves a boundary is in the medium of the
  side that it leaves to.
- Elsewhere, what is at a point is what the background has, plus the `interior` and less the `exterior` of every boundary around the
  point. So a ball that names the fog around it as its exterior displaces the fog, and one that names none has both. Of the media
  that come out, those of the highest `priority` are there, the others not: ice in a drink needs the higher one. Equal ones add up,
  also one medium twice. A medium without extinction and a high priority is a hole.
- Such boundaries should be closed: cubes, spheres, closed meshes, or several sheets that name the same media and close a body
  together.
- Surfaces that lie on each other are all crossed at once; of these, one that scatters light comes first. Fog may stand on the very
  plane of a floor.
- The camera is in the medium that the sensor names; where media overlap, in those of the closed boundaries around it as well (at the
  middle of the lens). A sensor that names none begins in none, also inside of a boundary, as in Mitsuba; a cube or sphere around it
  is warned of.
- Dielectrics know nothing of each other: each surface bends light by its own `int_ior` and `ext_ior`, whatever it lies in, as in
  Mitsuba; `priority` is of media alone. Where one body of glass or water touches another, give the surface between them once, with
  the two indices of its sides (water in a glass: one from water to glass); two surfaces in one place or across each other bend
  light twice.
- A mirrored cube, sphere or mesh keeps its interior inside, also where its normals turn inwards. (In Mitsuba 3.9 the medium is then
  outside.) `flip_normals` does turn inside and outside.
)";

std::string old_files_section() {
  std::string out(kOldFiles[0]);
  for (const Renamed& row : renamed_parameters())
    out += fmt::format("| {} `{}` | `{}` | `{}` |\n", row.tag, row.plugin, row.before, row.now);
  return out += kOldFiles[1];
}

std::string channel_names() {
  std::vector<std::string> names;
  for (const ChannelRow& row : channels())
    if (row.mitsuba && !row.ours.empty())
      names.push_back(row.theirs == row.ours ? fmt::format("`{}`", row.theirs)
                                             : fmt::format("`{}` (here `{}`)", row.theirs, row.ours));
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string integrators_section() {
  std::string out = "Integrators by their names, in all versions:\n\n| name | means |\n|---|---|\n";
  for (const IntegratorRow& row : integrators())
    if (row.name != row.ours || row.max_depth)
      out += fmt::format(
          "| `{}` | `{}`{}{}{} |\n", row.name, row.ours,
          row.max_depth ? fmt::format(" with max_depth {}", *row.max_depth) : "",
          row.default_depth >= 0 ? fmt::format(" with max_depth {} unless given", row.default_depth) : "",
          row.other_method ? ", with a warning" : "");
  for (const WrapperRow& row : integrator_wrappers())
    out += row.name == "aov"
               ? fmt::format(
                     "| `aov` | the integrator within it; its channels {} become layers of the image "
                     "(docs/reference/aovs.md) |\n",
                     channel_names())
               : fmt::format("| `{}` | the integrator within it, with a warning: {} |\n", row.name, row.lost);
  return out +
         "\nLight that passes straight through a surface (`null`, `mask`, `thindielectric`) adds no segment "
         "to its "
         "path, and shadow rays go\non, as in Mitsuba's `volpath`; Mitsuba's `path` counts a segment there. "
         "Without a limit to the depth both are the same.\n\n";
}

std::string meaningless_section() {
  std::string out = "## Accepted without effect\n\n| object | parameters | why |\n|---|---|---|\n";
  for (const MeaninglessRow& row : meaningless_table())
    out += fmt::format("| {}{} | `{}` | {} |\n", row.tag,
                       row.plugin.empty() ? "" : fmt::format(" `{}`", row.plugin),
                       fmt::join(row.parameters, "`, `"), row.because);
  return out + "\n";
}

std::string names_section() {
  return fmt::format(
      "## Names\n\nIndices of refraction: {}.\n\nMetals (`material` of `conductor` and `roughconductor`, "
      "instead of `eta` and `k`): {}.\n\n",
      fmt::join(named_iors(), ", "), fmt::join(named_metals(), ", "));
}

}  // namespace

std::string scene_format_markdown() {
  std::string out(kPreamble);
  add_variant<Geometry>(out, "Shapes");
  out += "Every shape has besides:\n\n";
  Rows common;
  const Shape shape;
  describe(common, shape);
  out += common.take();
  add_type<ShapeGroup>(out);
  add_type<Instance>(out);
  add_variant<Bsdf>(out, "Surfaces");
  add_variant<Texture>(out, "Textures");
  out += "## Light\n\n";
  add_type<AreaEmitter>(out);
  add_types(out, static_cast<const Emitter*>(nullptr));
  add_variant<Medium>(out, "Media");
  add_variant<Phase>(out, "Phase functions");
  add_variant<Volume>(out, "Volumes");
  out += "## Camera and integrator\n\n";
  add_type<Sensor>(out);
  add_type<Meter>(out);
  add_type<FilmSettings>(out);
  add_types(out, static_cast<const ReconstructionFilter*>(nullptr));
  add_type<IntegratorSettings>(out);
  out += integrators_section();
  out +=
      "A sampler, whatever its type, gives `sample_count` (default 4) samples a pixel. The films `ldrfilm`, "
      "`mfilm` and\n`tiledhdrfilm` are read as `hdrfilm`, with a warning.\n\n";
  out += old_files_section() + nori::markdown() + meaningless_section() + names_section();
  return out += kCanonical;
}

}  // namespace ls::scene
