// A scene prepared for tracing. Immutable once built; shared by all render threads.
#pragma once

#include <deque>
#include <vector>

#include "common/image/aov/aov.h"
#include "common/scene/analysis/needs.h"
#include "worker/render/base/features.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/camera/camera.h"
#include "worker/render/camera/pixel_filter.h"
#include "worker/render/geometry/accel.h"
#include "worker/render/geometry/geometry.h"
#include "worker/render/lights/lamp_directions.h"
#include "worker/render/lights/lights.h"
#include "worker/render/media/medium.h"
#include "worker/render/media/medium_stack.h"
#include "worker/render/render.h"
#include "worker/render/texture/texture.h"

namespace ls::render {

class World {
 public:
  World() = default;
  World(const World&) = delete;  // members point at each other
  World& operator=(const World&) = delete;

  Geometry geometry;
  TextureTable textures;
  BsdfTable bsdfs;
  std::deque<Grid> grids;  // a deque: media point at its elements
  std::vector<Medium> media;
  Lights lights;
  Accel accel;
  Camera camera;
  PixelFilter filter;

  std::uint32_t camera_medium = kNone;
  scene::Needs needs;             // of the scene; `need` is derived from it
  bool overlaps = false;          // media may be nested or intersect: paths keep a MediaState,
  MediaState camera_media;        // initialised from this
  bool coincident = false;        // some surfaces coincide, one of them null (coincident.h)
  bool lights_on_others = false;  // emitting null surfaces are among the coincident ones
  Features need;
  bool use_media = true;  // false for the integrator `path`, which ignores media
  // True if there are homogeneous media and lights with a position: then segments are also sampled
  // equi-angularly.
  bool equiangular = false;
  bool equiangular_points = false;  // the same in grids, if there are point lights in them or near them
  bool null_transmission = false;   // some surface has null transmission: shadow rays must collect it
  // True if shadow rays are traced boundary by boundary, for null transmission or because they may cross
  // media.
  bool shadows_walk = false;
  bool distant_mis = false;  // the integrator is `volpath_distant_mis` (segment_nee.h)
  // How points on segments are sampled and weighted by that integrator, and with `camera_points`
  DistanceSampling distance = DistanceSampling::mis;
  MisHeuristic heuristic = MisHeuristic::power;
  // With Features::aimed:
  Lamps lamps;  // about which directions are sampled too
  int camera_points =
      0;  // on a camera segment through a medium, at which light is looked for; 0: at vertices only
  bool hide_emitters = false;
  int max_depth = -1;  // maximum path length in segments; -1: unlimited
  // True if passing a null boundary or a null-transmitting surface counts as a segment for max_depth, as in
  // Mitsuba's `path`; false if not, as in its `volpath`.
  bool passing_counts = false;
  int rr_depth = 5;
  std::uint64_t seed = 0;
  FrameSize size;
  // The position of the image's top left pixel in the full frame, in pixels: a cropped image has the same
  // pixels there as the full frame.
  int origin_x = 0, origin_y = 0;

  AovSet aovs;
  // For the ID AOVs: the identifiers of the shape and the material of each surface, and of each instance. A
  // hit inside an instance has the instance's identifier in place of the shape's.
  std::vector<float> shape_ids, material_ids, instance_ids;

  Health inputs;  // corrected scene inputs, by cause

  bool depth_allows(int scatterings) const { return max_depth < 0 || scatterings < max_depth; }
};

}  // namespace ls::render
