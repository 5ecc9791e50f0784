#include <utility>

#include "validation/fixtures/case.h"

namespace ls::cases {

void Table::mean(std::string id, std::string rows, std::string about, Maker scene, const Channels& expected,
                 MeanOptions options) {
  options.channels = options.channels || expected[0] != expected[1] || expected[1] != expected[2];
  cases_.push_back(
      {std::move(id), std::move(rows), std::move(about), options, Mean{std::move(scene), expected}});
}

void Table::same(std::string id, std::string rows, std::string about, Maker scene, Maker other,
                 MeanOptions options) {
  cases_.push_back(
      {std::move(id), std::move(rows), std::move(about), options, Same{std::move(scene), std::move(other)}});
}

void Table::exact(std::string id, std::string rows, std::string about,
                  std::function<Figure(const Bench&)> check, bool slow) {
  MeanOptions options;
  options.slow = slow;
  cases_.push_back({std::move(id), std::move(rows), std::move(about), options, Exact{std::move(check)}});
}

Table all_cases() {
  Table t;
  add_depths(t);
  add_scales(t);
  add_grids(t);
  add_albedos(t);
  add_phases(t);
  add_lamps(t);
  add_light_shapes(t);
  add_slabs(t);
  add_single(t);
  add_fields(t);
  add_emission(t);
  add_furnaces(t);
  add_direct_light(t);
  add_seed(t);
  add_surfaces(t);
  add_rooms(t);
  add_interfaces(t);
  add_microfacets(t);
  add_places(t);
  add_bodies(t);
  add_skies(t);
  add_coatings(t);
  add_overlaps(t);
  add_slopes(t);
  add_bugs(t);
  return t;
}

}  // namespace ls::cases
