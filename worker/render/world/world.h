// A scene prepared for tracing. Immutable once built; shared by all render threads. In the comments below a
// null surface is one that is index-matched, so that light passes straight through it; a grid is a
// heterogeneous medium; and `Features` names the parts of the integrator that a scene needs (features.h).
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "core/image/aov/aov.h"
#include "core/scene/analysis/needs.h"
#include "worker/render/base/features.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/camera/camera.h"
#include "worker/render/geometry/accel.h"
#include "worker/render/geometry/geometry.h"
#include "worker/render/lights/emissive_grids.h"
#include "worker/render/lights/lamp_directions.h"
#include "worker/render/lights/light_vertices.h"
#include "worker/render/lights/lights.h"
#include "worker/render/media/field.h"
#include "worker/render/media/medium.h"
#include "worker/render/media/medium_stack.h"
#include "worker/render/render.h"
#include "worker/render/texture/texture.h"
#include "worker/render/world/deep_cache.h"

namespace ls::render {

class World {
 public:
  World() = default;
  World(const World&) = delete;  // not copyable, since members point at each other
  World& operator=(const World&) = delete;

  Geometry geometry;
  TextureTable textures;
  BsdfTable bsdfs;
  std::deque<Grid> grids;                            // a deque, since media point at its elements
  std::vector<std::unique_ptr<const Field>> fields;  // those that grids look their values up in
  PhaseFunctions phases;  // those of media that are not Henyey-Greenstein's, by their index in the scene
  std::vector<Medium> media;
  std::deque<ClearRegion> clear_regions;  // a deque, since media point at its elements
  Lights lights;
  Accel accel;
  Camera camera;
  // If the scene has meters: these, what their points refer to, and the surface of their white plates, which
  // no ray meets (index into geometry.surfaces)
  Meters meters;
  std::optional<LightWorld> meter_world;
  std::uint32_t plate = kNone;
  PixelFilter filter;

  std::uint32_t camera_medium = kNone;
  // True if boundaries of media may lie between the lens and the near plane (near_plane.h)
  bool hidden_boundaries = false;
  scene::Needs needs;       // what the scene contains; `need` is derived from this
  bool overlaps = false;    // true if media may be nested or intersect; each path then keeps a MediaState
  MediaState camera_media;  // if `overlaps`: the media state with which camera paths start
  bool coincident = false;  // true if surfaces coincide that some rays pass (coincident.h)
  // True if a null or hidden surface that emits light coincides with another surface
  bool lights_on_others = false;
  Features need;
  bool moves = false;     // true if the camera or a shape moves: camera rays then have times
  bool use_media = true;  // false for the integrators `path` and `whitted`, which ignore media
  // True if segments of paths in homogeneous media are also sampled equi-angularly about the lights that have
  // a position.
  bool equiangular = false;
  // True if segments in grids are also sampled equi-angularly, because a point light is in or near a grid
  bool equiangular_points = false;
  // True if shadow rays must take account of the surfaces that they pass straight through: some surface has
  // null transmission (a mask, a thin dielectric), which attenuates light, or each null surface that is
  // crossed counts as a segment (`passing_counts`)
  bool null_transmission = false;
  // True if a shadow ray is traced from one surface that it passes to the next, because of
  // `null_transmission` or because it may cross media.
  bool shadows_walk = false;
  bool distant_mis = false;  // true for the integrator `volpath_distant_mis` (segment_nee.h)
  // How the points of `volpath_distant_mis` and `camera_points` are placed on segments, and the heuristic of
  // their weights in multiple importance sampling
  DistanceSampling distance = DistanceSampling::mis;
  MisHeuristic heuristic = MisHeuristic::power;
  // The next three members are used with Features::aimed only.
  Lamps lamps;  // lights without extent: paths also sample directions that pass close to them
  // True if some flights through homogeneous media are made to end near lamps
  bool lamp_flights = false;
  // Number of points at which light is sampled on each segment that starts at the camera or at a delta lobe
  // (segment_nee.h); 0: none.
  int camera_points = 0;
  // The next five members are used with Features::connected only. The sun is the directional emitter that
  // lights the scene (light_vertices.h).
  Lights::Directional sun;  // the light vertices are on paths that start at it
  SunMap sun_map;
  // The number of light vertices among which each connection chooses one, divided by the mean number of light
  // vertices that one ray of the sun leaves behind. The weights of multiple importance sampling need this
  // ratio.
  float connections_per_ray = 1;
  // Connections that would add less radiance than this are made only with some probability (Russian roulette)
  float faint = 0;
  mutable LightVertexCache light_vertices;  // several threads may use it at once
  // With Features::grids: shadow rays that could add less radiance than this are traced only with some
  // probability (roulette.h); 0: all are traced.
  float faint_shadow = 0;
  // The mean radiance of the image, for the Russian roulette of paths in roulette.h; 0: roulette compares
  // throughputs with 1, as usual
  float mean_radiance = 0;
  bool paths_split = false;  // true if paths split in two at a first vertex in a grid (roulette.h)
  // True if a path's first vertex, on a surface, also samples a second direction towards the sky (aim.h)
  bool sky_samples = false;
  // With Features::reuse: the number of pixels in a group, whose paths share their tails, that is, the parts
  // from the second vertex on (path_reuse.h)
  int reuse = 0;
  // True if paths could be shared and the scene leaves the choice, but the AOVs have a denoiser's guides
  bool reuse_left_to_denoiser = false;
  EmissiveGrids emissive;      // empty unless next-event estimation looks for emissive grids (emission_nee.h)
  bool hide_emitters = false;  // true if camera rays see no light that was not scattered
  bool transparent = false;    // true if camera rays see no environment (FilmSettings::transparent)
  // True if camera rays do not see all of the environment, because of the two members above or
  // Lights::hides_environment()
  bool hide_environment = false;
  // True if some surfaces are hidden from shadow rays or scattered rays, or some lights from what receives
  // light, or if some lights are linked (LightReach)
  bool ray_flags = false;
  // The lists of link sets that have each surface and each medium (light_links.h)
  std::vector<scene::LinkMask> surface_links, medium_links;
  // True if rays that are scattered in some direction may meet other surfaces than shadow rays in that
  // direction. Shadow rays then decide about all light that comes straight from a light to a vertex that does
  // not scatter as a mirror does.
  bool direct_by_shadows = false;
  // Shadow rays decide likewise about light from lights that are linked to blockers, and there they also do
  // so for what scatters almost as a mirror. These are the lists of blockers of the lights about which shadow
  // rays decide and that scattered rays can hit.
  std::vector<scene::LinkIndex> shadow_lists;
  int max_depth = -1;  // maximum path length in segments; -1: unlimited
  // True if passing straight through a surface (null, or with null transmission) counts as a segment for
  // max_depth, as in Mitsuba's `path`; false if it does not, as in Mitsuba's `volpath`.
  bool passing_counts = false;
  int rr_depth = 5;
  std::uint64_t seed = 0;
  FrameSize size;
  FrameSize frame;  // the full frame, of which the image may be a part
  // The position of the image's top left pixel in the full frame, in pixels. A cropped image has the same
  // pixel values as that part of an image of the full frame.
  int origin_x = 0, origin_y = 0;

  AovSet aovs;
  mutable DeepEdgesCache deep_edges;  // with a deep image; several threads may use it at once
  // For the AOVs of identifiers (Cryptomatte): by surface, the identifiers of its shape and its material; and
  // the identifiers of the instances. For a hit inside an instance, the instance's identifier replaces the
  // shape's.
  std::vector<float> shape_ids, material_ids, instance_ids;

  Health inputs;  // number of corrected input values of the scene, by cause

  bool depth_allows(int scatterings) const { return max_depth < 0 || scatterings < max_depth; }
};

}  // namespace ls::render
