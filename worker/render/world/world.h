// A scene prepared for tracing. Immutable once built; shared by all render threads.
#pragma once

#include <deque>
#include <vector>

#include "common/image/aov/aov.h"
#include "common/scene/analysis/needs.h"
#include "worker/render/base/features.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/camera/camera.h"
#include "worker/render/geometry/accel.h"
#include "worker/render/geometry/geometry.h"
#include "worker/render/lights/lamp_directions.h"
#include "worker/render/lights/light_vertices.h"
#include "worker/render/lights/lights.h"
#include "worker/render/media/medium.h"
#include "worker/render/media/medium_stack.h"
#include "worker/render/render.h"
#include "worker/render/texture/texture.h"

namespace ls::render {

class World {
 public:
  World() = default;
  World(const World&) = delete;  // not copyable, since members point at each other
  World& operator=(const World&) = delete;

  Geometry geometry;
  TextureTable textures;
  BsdfTable bsdfs;
  std::deque<Grid> grids;  // a deque, since media point at its elements
  std::vector<Medium> media;
  std::deque<ClearRegion> clear_regions;  // a deque, since media point at its elements
  Lights lights;
  Accel accel;
  Camera camera;
  PixelFilter filter;

  std::uint32_t camera_medium = kNone;
  scene::Needs needs;       // needs of the scene; `need` is derived from them
  bool overlaps = false;    // true if media may be nested or intersect; each path then keeps a MediaState
  MediaState camera_media;  // with overlaps: the state with which paths start at the camera
  bool coincident = false;  // true if some surfaces coincide, one of them null (coincident.h)
  bool lights_on_others = false;  // true if there are emitting null surfaces among the coincident ones
  Features need;
  bool use_media = true;  // false for the integrators `path` and `whitted`, which ignore media
  // True if there are homogeneous media and lights with a position: then segments are also sampled
  // equi-angularly.
  bool equiangular = false;
  bool equiangular_points = false;  // the same in grids: true if there are point lights in or near them
  // True if shadow rays must account for surfaces that light passes: some surface has null transmission, or
  // crossings of null boundaries count (`passing_counts`)
  bool null_transmission = false;
  // True if shadow rays are traced boundary by boundary, for null transmission or because they may cross
  // media.
  bool shadows_walk = false;
  bool distant_mis = false;  // true for the integrator `volpath_distant_mis` (segment_nee.h)
  // How points on segments are sampled and weighted, by `volpath_distant_mis` and with `camera_points`
  DistanceSampling distance = DistanceSampling::mis;
  MisHeuristic heuristic = MisHeuristic::power;
  // With Features::aimed:
  Lamps lamps;                // lights without extent, near which directions are also sampled
  bool lamp_flights = false;  // true if a share of the flights through homogeneous media ends near lamps
  int camera_points = 0;      // number of points on a segment (segment_nee.h); 0: none
  // With Features::connected:
  Lights::Directional sun;  // the light that the light vertices come from
  SunMap sun_map;
  // The number of light vertices from which a connection chooses one, divided by the mean number of light
  // vertices that one ray of the sun leaves. The weights of multiple importance sampling need this ratio.
  float connections_per_ray = 1;
  float faint = 0;  // connections that would add less than this are made at random (Russian roulette)
  mutable LightVertexCache light_vertices;  // safe from several threads
  // With Features::grids: shadow rays that could add less than this are traced at random (roulette.h);
  // 0: all are traced.
  float faint_shadow = 0;
  // The mean radiance of the image, for Russian roulette (roulette.h); 0: roulette compares with 1
  float mean_radiance = 0;
  bool paths_split = false;  // paths split at their first vertex if it is in a grid (roulette.h)
  // True if the first vertex, on a surface, samples a second direction towards the sky (aim.h)
  bool sky_samples = false;
  // With Features::reuse: the number of pixels whose paths share their tails (path_reuse.h)
  int reuse = 0;
  bool hide_emitters = false;
  int max_depth = -1;  // maximum path length in segments; -1: unlimited
  // True if passing a null boundary or a null-transmitting surface counts as a segment for max_depth, as in
  // Mitsuba's `path`; false in its `volpath`.
  bool passing_counts = false;
  int rr_depth = 5;
  std::uint64_t seed = 0;
  FrameSize size;
  FrameSize frame;  // the full frame, of which the image may be a part
  // The position of the image's top left pixel in the full frame, in pixels. A cropped image has the same
  // pixels as this part of the full frame.
  int origin_x = 0, origin_y = 0;

  AovSet aovs;
  // For the ID AOVs: the identifiers of the shape and the material of each surface, and of each instance. For
  // a hit inside an instance, the instance's identifier replaces the shape's.
  std::vector<float> shape_ids, material_ids, instance_ids;

  Health inputs;  // corrected inputs of the scene, by cause

  bool depth_allows(int scatterings) const { return max_depth < 0 || scatterings < max_depth; }
};

}  // namespace ls::render
