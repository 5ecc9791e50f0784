// Which optional parts of the renderer this build has: all of them. Only the experiment behind
// docs/measurements/leave-out.md builds without some (cmake -DLIGHTSHAFT_WITHOUT=grids,textures), to see what
// their presence costs a scene that does not use them; such a build refuses scenes that do.
#pragma once

#include <string_view>

#include "worker/render/features.h"

#ifndef LIGHTSHAFT_WITHOUT
#define LIGHTSHAFT_WITHOUT ""
#endif

namespace ls::render {

struct Built {
  Features features = kEverything;
  bool boundaries = true;       // index-matched surfaces
  bool veils = true;            // masks, thin sheets
  bool textures = true;         // anything but constants
  bool user_geometries = true;  // spheres, disks, cylinders
  bool instances = true;
  bool environment_maps = true;
  bool equiangular = true;
  bool light_trees = true;
  bool lenses = true;
  bool found_lights = true;  // lights that rays can meet: with an extent, or the surroundings
  // What no scene can do without, but whose price is to be known: the guards that count what goes wrong.
  bool health = true;
};

// Names with commas between them; an unknown one does not compile.
constexpr Built built_without(std::string_view list) {
  Built b;
  while (!list.empty()) {
    const auto comma = list.find(',');
    const std::string_view name = list.substr(0, comma);
    list = comma == std::string_view::npos ? std::string_view() : list.substr(comma + 1);
    const struct {
      std::string_view name;
      bool& part;
    } parts[] = {{"media", b.features.media},
                 {"grids", b.features.grids},
                 {"chromatic", b.features.chromatic},
                 {"emission", b.features.emission},
                 {"overlaps", b.features.overlaps},
                 {"boundaries", b.boundaries},
                 {"veils", b.veils},
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
