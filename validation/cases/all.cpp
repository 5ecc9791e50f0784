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
  for (AddCases* const add :
       {add_depths,          add_scales,       add_grids,        add_albedos, add_phases,
        add_lamps,           add_light_shapes, add_slabs,        add_single,  add_fields,
        add_emission,        add_furnaces,     add_direct_light, add_seed,    add_surfaces,
        add_rooms,           add_interfaces,   add_microfacets,  add_places,  add_bodies,
        add_skies,           add_coatings,     add_overlaps,     add_slopes,  add_bugs,
        add_phase_functions, add_height_fog})
    add(t);
  return t;
}

}  // namespace ls::cases
