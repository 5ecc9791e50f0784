// Translates pbrt's medium "cloud", whose density is a formula, to a grid.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "common/base/digest.h"
#include "common/scene/pbrt/cloud.h"
#include "common/scene/pbrt/media_parts.h"

namespace ls::scene::pbrt {
namespace {

// Largest number of nodes of one grid, and of all grids of clouds in a file.
constexpr std::size_t kMaxNodes = std::size_t{1} << 24, kMaxNodesOfAll = std::size_t{1} << 25;

// Returns the name of the grid's file. It is a digest of the formula's parameters and the grid's size, so
// that a grid that exists already, such as one sent to a coordinator, is found without computing it, which
// would take seconds.
std::string name_of(const Cloud& c, const CloudNodes& nodes) {
  const std::string formula =
      fmt::format("cloud {} {} {} {} {} {}", c.density, c.wispiness, c.frequency, fmt::join(c.low, " "),
                  fmt::join(c.high, " "), fmt::join(nodes.sides, " "));
  return fmt::format("cloud-{}.vol", sha256(formula).hex().substr(0, 16));
}

// Returns the grid's file. Empty: it would be too large or could not be kept, which was reported.
std::string file_of(MediumSource& m, const Cloud& cloud) {
  auto& made = m.t.clouds;
  const auto same = std::find_if(made.begin(), made.end(), [&](const auto& c) { return c.cloud == cloud; });
  if (same != made.end()) return same->file;
  std::size_t used = 0;
  for (const MadeCloud& c : made) used += c.nodes;
  const std::size_t most = std::min(kMaxNodes, kMaxNodesOfAll - used);
  const auto nodes = nodes_for(cloud, most);
  if (!nodes) {
    m.wrong(m.p.at(),
            fmt::format("{} is too fine for its box: its grid would have more than {} nodes (of {} for all "
                        "clouds) with {} in a cell of its finest noise; lower its frequency, make its box "
                        "smaller, or give a file of \"nanovdb\"",
                        m.p.title(), most, kMaxNodesOfAll, kLeastPerCell));
    return {};
  }
  if (nodes->per_cell < kWantedPerCell)
    m.t.warn_once(
        m.p.at(),
        fmt::format("a \"cloud\" is a grid here; of {} x {} x {} nodes this one has {:.1f} along a "
                    "cell of its finest noise, where {} would be more exact",
                    nodes->sides[0], nodes->sides[1], nodes->sides[2], nodes->per_cell, kWantedPerCell));
  const std::string file = name_of(cloud, *nodes);
  if (!m.t.assets.find(file)) {
    if (!m.t.assets.keeps()) {
      m.wrong(m.p.at(), fmt::format("the grid of {} is a file \"{}\", which `lightshaft submit` sends along",
                                    m.p.title(), file));
      return {};
    }
    if (const auto kept = keep_made(m.t.assets, cloud_grid(cloud, *nodes), file); !kept) {
      m.wrong(m.p.at(), kept.error().message);
      return {};
    }
  }
  made.push_back({cloud, nodes->count(), file});
  return file;
}

}  // namespace

bool cloud(MediumSource& m, Element& out) {
  const Coefficients c = coefficients(m);
  Cloud cloud;
  cloud.density = m.p.number("density", cloud.density);
  cloud.wispiness = m.p.number("wispiness", cloud.wispiness);
  cloud.frequency = m.p.number("frequency", cloud.frequency);
  Box box;
  if (!read_box(m, box)) return false;
  cloud.low = box.low;
  cloud.high = box.high;
  add_albedo(m, out, c.albedo);
  add_extinction(m, out, c.extinction);
  const std::string file = file_of(m, cloud);
  if (file.empty()) return false;
  add_volume(m, out, "sigma_t", file, box, Filling::nodes);
  return true;
}

}  // namespace ls::scene::pbrt
