// The optional parts of the renderer that this build contains: normally all of them. Only the experiment of
// docs/measurements/leave-out.md builds without some (cmake -DLIGHTSHAFT_WITHOUT=grids,textures), to measure
// what their presence costs a scene that does not use them; such a build refuses scenes that need them.
#pragma once

#include <string_view>

#ifndef LIGHTSHAFT_WITHOUT
#define LIGHTSHAFT_WITHOUT ""
#endif

namespace ls::render {

struct Built {
  bool media = true, grids = true, chromatic = true, emission = true, overlaps = true;  // see features.h
  bool boundaries = true;         // index-matched surfaces
  bool null_transmission = true;  // null transmission of masks and thin sheets
  bool textures = true;           // anything but constant textures
  bool user_geometries = true;    // spheres, disks, cylinders
  bool instances = true;
  bool environment_maps = true;
  bool equiangular = true;
  bool light_trees = true;
  bool lenses = true;
  bool found_lights = true;  // lights that rays can hit: area lights and environments
  // The checks that count bad samples. Every scene needs them; they can be left out only so that their cost
  // can be measured.
  bool health = true;
};

// All parts but those named in `list`. The names in `list` are separated by commas; an unknown name is a
// compile error.
constexpr Built built_without(std::string_view list) {
  Built b;
  while (!list.empty()) {
    const auto comma = list.find(',');
    const std::string_view name = list.substr(0, comma);
    list = comma == std::string_view::npos ? std::string_view() : list.substr(comma + 1);
    const struct {
      std::string_view name;
      bool& part;
    } parts[] = {{"media", b.media},
                 {"grids", b.grids},
                 {"chromatic", b.chromatic},
                 {"emission", b.emission},
                 {"overlaps", b.overlaps},
                 {"boundaries", b.boundaries},
                 {"veils", b.null_transmission},
                 {"textures", b.textures},
                 {"user_geometries", b.user_geometries},
                 {"instances", b.instances},
                 {"environment_maps", b.environment_maps},
                 {"equiangular", b.equiangular},
                 {"light_trees", b.light_trees},
                 {"lenses", b.lenses},
                 {"found_lights", b.found_lights},
                 {"health", b.health}};
    bool known = false;
    for (const auto& p : parts)
      if (p.name == name) p.part = false, known = true;
    if (!known) throw "LIGHTSHAFT_WITHOUT names a part that does not exist";
  }
  return b;
}
inline constexpr Built kBuilt = built_without(LIGHTSHAFT_WITHOUT);

}  // namespace ls::render
