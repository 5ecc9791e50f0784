// An integrator in a race: renders the rounds (ranges of samples) of a job as usual and folds them (adds them
// to the image), on threads of this process. Its time includes rendering, folding and estimating the error,
// but not loading the scene.
#pragma once

#include <memory>

#include "compare/racer.h"
#include "worker/render/render.h"

namespace ls::race {

struct RenderEntry {
  std::shared_ptr<const render::World> world;
  TileGrid grid;
  std::string name;  // for file names: the lane's name, unique in `folder`
  std::filesystem::path folder;
};
// Makes the racer. It also renders a few samples that are not counted, to warm up memory.
std::unique_ptr<Racer> make_render_racer(RenderEntry entry, const Conditions& conditions, const Clock& clock);

}  // namespace ls::race
