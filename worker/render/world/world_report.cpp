// Describes a built world (WorldReport): which features it uses and which it does not, and the memory of each
// structure.
#include <fmt/format.h>

#include "worker/render/world/world.h"

namespace ls::render {
namespace {

std::string counted(std::uint64_t n, std::string_view what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

// The numbers of primitives by kind, as in "12 triangles, 2 spheres".
std::string primitives(const Geometry& g) {
  std::string text;
  const auto add = [&](std::uint64_t n, std::string_view what) {
    if (n > 0) text += (text.empty() ? "" : ", ") + counted(n, what);
  };
  add(g.triangle_count(), "triangle");
  add(g.spheres.size(), "sphere");
  add(g.disks.size(), "disk");
  add(g.cylinders.size(), "cylinder");
  add(g.instances.size(), "instance");
  return text.empty() ? "no shape" : text;
}

std::vector<WorldReport::Structure> structures_of(const World& w) {
  std::uint64_t values = 0, cells = 0, value_count = 0, sparse = 0, halves = 0;
  for (const auto& field : w.fields) values += field->bytes();
  for (const Grid& g : w.grids) {
    cells += g.majorant_bytes();
    values += g.bytes() - g.majorant_bytes();
    value_count += g.voxels().count();
    sparse += g.lookup() != Lookup::field && !g.voxels().dense();
    halves += g.voxels().halves();
  }
  const EnvironmentMap* map = w.lights.map();
  const std::string grids =
      w.grids.empty() ? "no grid"
                      : fmt::format("{} of {} values{}{}", counted(w.grids.size(), "grid"), value_count,
                                    sparse > 0 ? fmt::format(", {} sparse", sparse) : "",
                                    halves > 0 ? fmt::format(", {} of half floats", halves) : "");
  return {{"geometry", w.geometry.bytes(), primitives(w.geometry)},
          {"bvh", w.accel.bytes(),
           w.accel.has_boundaries() ? "one for all, one for what blocks light, one for what lets it pass"
                                    : "one; nothing lets light pass"},
          {"materials", w.bsdfs.bytes(), counted(w.bsdfs.size(), "material")},
          {"textures", w.textures.bytes(), w.textures.bytes() > 0 ? "texels" : "no image"},
          {"environment map", w.lights.map_bytes(), map ? "texels and the table that samples them" : "none"},
          {"grid values", values, grids},
          {"majorant cells", cells, grids},
          {"light table", w.lights.table_bytes(), counted(w.lights.count(), "light")},
          {"emissive cells", w.emissive.bytes(), counted(w.emissive.cell_count(), "cell")},
          {"light tree", w.lights.tree_bytes(),
           w.lights.has_tree()          ? counted(w.lights.in_tree(), "light")
           : w.lights.enough_for_tree() ? "switched off"
                                        : "too few lights with a place to choose among"}};
}

}  // namespace

TechniqueSet techniques_of(const World& w) {
  TechniqueSet set;
  const auto put = [&](bool used, Technique t) {
    if (used) set.add(t);
  };
  const bool segments = w.distant_mis && w.need.media && w.lights.can_sample();
  const bool angles = w.lights.any_with_place() && w.distance != DistanceSampling::exponential;
  put(segments ? angles : w.equiangular || w.equiangular_points, Technique::equiangular);
  put(segments && (w.distance != DistanceSampling::equiangular || w.lights.any_without_place()),
      Technique::exponential);
  put(w.camera_points > 0, Technique::camera_points);
  put(w.lamps.count > 0, Technique::lamp_directions);
  put(w.lamp_flights, Technique::lamp_flights);
  put(w.need.connected, Technique::light_vertices);
  put(w.lights.uses_tree(w.need.media), Technique::light_tree);
  put(w.need.reuse, Technique::path_reuse);
  put(w.faint_shadow > 0, Technique::shadow_roulette);
  put(w.sky_samples, Technique::sky_samples);
  put(w.mean_radiance > 0, Technique::path_splitting);
  put(w.lights.portals(), Technique::sky_portals);
  put(w.lights.local(), Technique::local_lights);
  put(w.emissive.any(), Technique::emissive_grids);
  return set;
}

WorldReport describe(const World& w) {
  WorldReport r;
  r.variant = covering_variants(w).front();
  r.variants = all_variants(w).size();
  const auto feature = [&](bool used, const std::string& text) {
    (used ? r.used : r.left_out).push_back(text);
  };
  feature(w.need.media, "participating media");
  feature(w.need.grids, "density grids, majorants and their trackers");
  feature(w.need.height, "fog that falls with height");
  feature(w.need.chromatic, "spectral weights for extinction that differs between channels");
  feature(w.need.phases, "phase functions other than Henyey-Greenstein's");
  feature(w.need.emission, "light given off by media");
  feature(w.overlaps, "media within or across each other");
  feature(w.coincident, "a search for surfaces that lie on null or hidden ones");
  feature(w.need.split, "AOVs of light");
  feature(w.needs.flagged_shapes > 0, "surfaces hidden from the camera, held out or that catch shadows");
  feature(w.needs.ray_flags > 0, "surfaces and lights hidden from shadow or scattered rays");
  feature(w.needs.linked_lights > 0, "lights linked to receivers or blockers");
  const TechniqueSet techniques = techniques_of(w);
  feature(techniques.has(Technique::equiangular), "equi-angular sampling about lights");
  feature(techniques.has(Technique::exponential), "points along segments, as light fades");
  feature(techniques.has(Technique::camera_points), "points on camera segments at which light is sampled");
  feature(techniques.has(Technique::lamp_directions), "directions near lights without extent");
  feature(techniques.has(Technique::lamp_flights), "flights that end near lights without extent");
  feature(techniques.has(Technique::light_vertices), "connections to points that the sun lights");
  feature(w.accel.has_boundaries(), "boundary BVH for index-matched surfaces");
  feature(w.lights.can_sample(), "next-event estimation");
  feature(w.lights.count() > 1, "choice among lights");
  feature(techniques.has(Technique::light_tree), "tree of lights");
  feature(techniques.has(Technique::path_reuse),
          w.reuse_left_to_denoiser ? "paths that serve several pixels, since the image is made for a denoiser"
                                   : "paths that serve several pixels");
  feature(techniques.has(Technique::sky_samples), "second directions that look for the sky");
  feature(techniques.has(Technique::shadow_roulette), "shadow rays at random where they could bring little");
  feature(techniques.has(Technique::sky_portals), "directions towards the sky through openings");
  feature(techniques.has(Technique::local_lights), "lights chosen by what reaches a place");
  feature(techniques.has(Technique::emissive_grids), "directions towards emissive grids");
  feature(techniques.has(Technique::path_splitting), "paths that split, or end, by what their pixel shows");
  feature(w.camera.has_lens(), "thin lens");
  feature(w.camera.moves(), "camera motion");
  feature(!w.geometry.moving.empty(), "shapes that move");
  feature(w.geometry.instances.size() > w.geometry.moving.size(), "instances of groups that stand still");
  feature(w.geometry.primitive_count() > w.geometry.triangle_count(), "user geometries in the BVH");
  feature(w.textures.bytes() > 0, "image textures");
  feature(w.lights.map(), "environment map, sampled by its brightness");
  if (w.lights.left_out())
    r.left_out.push_back(fmt::format("{} lights without power or area", w.lights.left_out()));
  r.structures = structures_of(w);
  for (const auto& [cause, entry] : w.inputs.causes) r.clamped_inputs += entry.count;
  return r;
}

}  // namespace ls::render
