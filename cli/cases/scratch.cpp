#include <fmt/format.h>
#include "cli/cases/case.h"
#include "cli/cases/stages.h"
namespace ls::cases {
void add_scratch(Table& t);
void add_scratch(Table& t) {
  for (const Way& way : both_media())
    for (double tau : {1e4, 1e6, 4e6})
      for (int depth : {2, 3, 100000}) {
        t.mean(fmt::format("X-{:g}-{}{}", tau, depth, way.name()), "X", "x",
               [=] {
                 SceneKit kit = half_space(way, .9, tau, 1);
                 kit.scene.integrator.max_depth = depth == 100000 ? -1 : depth;
                 return kit;
               },
               grey(depth == 2   ? .9 * .153426410
                    : depth == 3 ? .238
                                 : .414947),
               {.band = .001});
      }
}
}  // namespace ls::cases
