// Lightshaft itself in a race: the rounds of a job, rendered and folded as in one, on threads of this
// process. Its time is that of rendering, folding and estimating the error; the scene is loaded before.
#pragma once

#include <memory>

#include "cli/compare/racer.h"
#include "worker/render/render.h"

namespace ls::race {

struct RenderEntry {
  std::shared_ptr<const render::World> world;
  TileGrid grid;
  std::string name;  // of files: the lane's, unique in `folder`
  std::filesystem::path folder;
};
// Renders a little that is not counted, so that memory is warm.
std::unique_ptr<Racer> make_render_racer(RenderEntry entry, const Conditions& conditions, const Clock& clock);

}  // namespace ls::race
