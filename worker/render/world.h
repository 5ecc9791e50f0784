// A scene made ready to trace. Immutable once built and shared by all render threads.
#pragma once

#include <deque>
#include <vector>

#include "common/image/aov.h"
#include "common/scene/needs.h"
#include "worker/render/accel.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/camera.h"
#include "worker/render/features.h"
#include "worker/render/geometry.h"
#include "worker/render/lights.h"
#include "worker/render/media_state.h"
#include "worker/render/medium.h"
#include "worker/render/pixel_filter.h"
#include "worker/render/render.h"
#include "worker/render/texture/texture.h"

namespace ls::render {

class World {
 public:
  World() = default;
  World(const World&) = delete;  // parts point at each other
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
  scene::Needs needs;             // of the scene; `need` follows from it
  bool overlaps = false;          // media may lie within or across each other: paths keep a MediaState,
  MediaState camera_media;        // which begins as this
  bool coincident = false;        // surfaces lie on each other, one of them null (coincident.h)
  bool lights_on_others = false;  // null ones that shine are among them
  Features need;
  bool use_media = true;     // false: the integrator `path`, which sees no media
  bool equiangular = false;  // homogeneous media and lights with a place: segments are sampled about them too
  bool equiangular_points = false;  // the same in grids, if points shine in them
  bool veils = false;               // some surface lets a share of the light pass: shadow rays collect it
  bool shadows_walk = false;        // for that, or because they may cross media
  bool distant_mis = false;         // the integrator `volpath_distant_mis` (distant_mis.h), and its choices
  DistanceSampling distance = DistanceSampling::mis;
  MisHeuristic heuristic = MisHeuristic::power;
  bool hide_emitters = false;
  int max_depth = -1;  // segments; -1: unlimited
  // Null boundaries and surfaces that let light pass end segments: as Mitsuba's `path` counts, but not its
  // `volpath`.
  bool passing_counts = false;
  int rr_depth = 5;
  std::uint64_t seed = 0;
  FrameSize size;
  // Of the image in the full frame, in pixels: the pixels of a crop are those of the frame.
  int origin_x = 0, origin_y = 0;

  AovSet aovs;
  // For the AOVs of these names: identifiers of each surface, and of each instance what the surfaces have
  // else.
  std::vector<float> shape_ids, material_ids, instance_ids;

  Health inputs;  // what was changed of the scene's inputs, by cause

  bool depth_allows(int scatterings) const { return max_depth < 0 || scatterings < max_depth; }
};

}  // namespace ls::render
