#include <fmt/format.h>

#include "common/scene/gltf/support_table.h"
#include "tests/unit/scene/pages/pages.h"

namespace ls::scene {
namespace {

constexpr std::string_view kGltfHead = R"(# Scenes of glTF

<!-- Made by gltf_markdown() from the table in common/scene/gltf/support_table.cpp; do not edit. -->

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
  of 1 with a volume and without textures is a `dielectric`, or a `roughdielectric`.
- **Sides**: surfaces are seen from both sides whatever doubleSided says. A body of glass must be closed, with its front outside. What
  gives light does so on the front only.
- **Normal maps** lean along u and along the cross product of normal and u. Where an image is mirrored on a mesh they lean the
  other way across u than glTF's tangents, with a warning.
- **Spots** fall off linearly in the angle between their two angles, with a warning.
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

}  // namespace ls::scene
