// The whole table of the scene language: it describes all kinds of objects, and the scene that consists of
// them, by describe() (describe.h).
#pragma once

#include "core/scene/schema/describe_emitters.h"
#include "core/scene/schema/describe_media.h"
#include "core/scene/schema/describe_shapes.h"
#include "core/scene/schema/describe_surfaces.h"
#include "core/scene/schema/integrators.h"

namespace ls::scene {

LS_TYPE(IntegratorSettings, "integrator", "volpath", "volpath, volpath_distant_mis, path, whitted",
        "how light is followed. `path` and `whitted` leave media out. `whitted` is Nori's: what mirrors and "
        "clear glass show, however many, and where they lead to on any other surface the light that comes "
        "straight from lamps; light that such surfaces send each other, and what mirrors throw on them, is "
        "left out")
template <class V, Of<IntegratorSettings> T>
void describe(V& v, T& i) {
  v.field({.name = "name",
           .doc = "\"volpath\", \"volpath_distant_mis\", or \"path\" and \"whitted\", which leave media out",
           .derived = true},
          i.name);
  v.field({.name = "max_depth",
           .doc = "longest path in segments: 1 emission, 2 direct light; -1: no limit",
           .range = {-1, kMaxDepthSetting}},
          i.max_depth);
  v.field({.name = "rr_depth",
           .doc = "depth from which Russian roulette may end a path",
           .range = {1, kMaxDepthSetting}},
          i.rr_depth);
  v.field({.name = "hide_emitters", .doc = "lights are invisible to the camera"}, i.hide_emitters);
  v.field({.name = "distance",
           .doc = "where on a ray's way through a medium it looks for light: as light fades (`exponential`), "
                  "near the light (`equiangular`), or both (`mis`)",
           .only_of = {kDistantMis}},
          i.distance);
  v.field({.name = "heuristic", .doc = "weighs the two against each other", .only_of = {kDistantMis}},
          i.heuristic);
  // Describes a parameter that switches a sampling technique on or off. With the default, 0, the technique
  // is used where it lowers the error at equal render time or, for some techniques, wherever it is possible.
  const auto technique = [&](std::string_view name, Range range, std::array<std::string_view, 2> only_of,
                             std::string_view doc, auto& value) {
    v.field({.name = name, .doc = doc, .range = range, .elided = true, .only_of = only_of}, value);
  };
  technique("camera_points", {-1, kMaxCameraPoints}, {"volpath"},
            "points of a camera ray's way through a medium at which it looks for light; 0: as many as pay "
            "for the scene, perhaps none; -1: none, only where the ray is scattered",
            i.camera_points);
  v.field({.name = "phase_only",
           .doc = "in media with point, spot or projector lights too, directions are those of the phase "
                  "function and the material, none is aimed at such a light",
           .elided = true,
           .only_of = {"volpath"}},
          i.phase_only);
  technique("light_vertices", {-1, 1}, {"volpath", "path"},
            "whether paths are connected to points that a directional emitter lights; 0: if that pays for "
            "the scene; -1: never; 1: always, as far as it is possible",
            i.light_vertices);
  technique("equiangular", {-1, 0}, {"volpath"},
            "whether light near lamps is looked for along whole ways through a medium; 0: if that pays for "
            "the scene; -1: only where a ray is scattered, and nothing is aimed at lamps",
            i.equiangular);
  technique("lamp_flights", {-1, 0}, {"volpath"},
            "whether a tenth of all flights through homogeneous media end near point, spot and projector "
            "lights; 0: if directions are aimed at these; -1: never",
            i.lamp_flights);
  technique(
      "light_tree", {-1, 0}, {},
      "how one of 32 lights and more is chosen; 0: by distance, direction and power; -1: by power alone",
      i.light_tree);
  technique(
      "path_reuse", {-1, 64}, {"volpath", "path"},
      "how many pixels share what their paths find from the second scattering on, where media are "
      "homogeneous; 0: 16 if that pays for the scene and the image has no AOVs for a denoiser, else none; "
      "-1 or 1: none",
      i.path_reuse);
  technique("shadow_roulette", {-1, 0}, {"volpath"},
            "whether shadow rays through grids that could bring little are traced at random; 0: where it is "
            "possible; -1: never",
            i.shadow_roulette);
  technique("sky_samples", {-1, 0}, {"volpath", "path"},
            "whether the first surface looks for a `constant` environment in a second direction; 0: in "
            "scenes without media, if that pays; -1: never",
            i.sky_samples);
  technique(
      "sky_portals", {-1, 1}, {"volpath", "path"},
      "whether directions towards the sky, an `envmap` or a `constant` environment, are also sampled through "
      "the openings by which its light enters the scene; 0: if that pays; -1: never; 1: where it is possible",
      i.sky_portals);
  technique("local_lights", {-1, 1}, {"volpath", "path"},
            "whether 2 to 64 lights are chosen by which of them reach the place that is lit, as camera paths "
            "learned it; 0: if that pays; -1: never; 1: where it is possible",
            i.local_lights);
  technique(
      "emissive_grids", {-1, 1}, {"volpath"},
      "whether light is also looked for in the directions of the cells of grids that give off light, such "
      "as fire; 0: if that pays; -1: never; 1: where it is possible",
      i.emissive_grids);
  technique("path_splitting", {-1, 0}, {"volpath"},
            "in scenes with grids, whether paths split at their first scattering if it is in a grid, and "
            "Russian roulette compares their weight with that behind the first scattering; 0: where it is "
            "possible; -1: never",
            i.path_splitting);
}

template <class V, Of<Asset> T>
void describe(V& v, T& a) {
  v.field({.name = "name", .doc = "as the scene calls the file", .derived = true}, a.name);
  v.field({.name = "sha256", .doc = "digest of its bytes", .derived = true}, a.digest);
  v.field({.name = "bytes", .doc = "its size", .derived = true}, a.bytes);
}
template <class V, Of<Label> T>
void describe(V& v, T& l) {
  v.field({.name = "name", .doc = "of the shape or instance", .derived = true}, l.name);
  v.field({.name = "material", .doc = "of the shape's material", .derived = true}, l.material);
}
template <class V, Of<Scene> T>
void describe(V& v, T& s) {
  v.field({.name = "assets", .doc = ""}, s.assets);
  v.field({.name = "textures", .doc = ""}, s.textures);
  v.field({.name = "bsdfs", .doc = ""}, s.bsdfs);
  v.field({.name = "volumes", .doc = ""}, s.volumes);
  v.field({.name = "phases", .doc = ""}, s.phases);
  v.field({.name = "media", .doc = ""}, s.media);
  v.field({.name = "shapes", .doc = ""}, s.shapes);
  v.field({.name = "emitters", .doc = ""}, s.emitters);
  v.field({.name = "sensor", .doc = ""}, s.sensor);
  v.field({.name = "film", .doc = ""}, s.film);
  v.field({.name = "integrator", .doc = ""}, s.integrator);
  v.field({.name = "sample_count", .doc = "samples per pixel, of the sampler", .range = {1, kMaxSpp}},
          s.sample_count);
  v.field({.name = "groups", .doc = ""}, s.groups);
  v.field({.name = "instances", .doc = ""}, s.instances);
  v.field({.name = "aovs", .doc = "", .elided = true}, s.aovs);
  v.field({.name = "shape_labels", .doc = "", .elided = true}, s.shape_labels);
  v.field({.name = "instance_labels", .doc = "", .elided = true}, s.instance_labels);
  v.field({.name = "meters", .doc = "", .elided = true}, s.meters);
}

// A visitor that does nothing; the concept Described uses it to find out whether a type has a describe().
struct AnyVisitor {
  template <class T>
  void field(const Field&, T&) {}
};
template <class T>
concept Described = requires(AnyVisitor& v, T& t) {
  describe(v, t);
};

// Returns the list of the scene s into which this type of index points, such as s.textures for a
// TextureIndex.
template <class S, class Tag>
auto& pool(S& s, Index<Tag>) {
  if constexpr (std::is_same_v<Tag, AssetTag>)
    return (s.assets);
  else if constexpr (std::is_same_v<Tag, TextureTag>)
    return (s.textures);
  else if constexpr (std::is_same_v<Tag, BsdfTag>)
    return (s.bsdfs);
  else if constexpr (std::is_same_v<Tag, VolumeTag>)
    return (s.volumes);
  else if constexpr (std::is_same_v<Tag, PhaseTag>)
    return (s.phases);
  else if constexpr (std::is_same_v<Tag, MediumTag>)
    return (s.media);
  else if constexpr (std::is_same_v<Tag, MeterTag>)
    return (s.meters);
  else
    return (s.groups);
}

// A visitor: walk(x) calls on_index for every index (TextureIndex, ...) that x contains at any depth. It does
// not go on to the objects that the indices refer to.
template <class F>
class IndexWalker {
 public:
  explicit IndexWalker(F on_index) : on_index_(on_index) {}
  template <class T>
  void field(const Field&, T& value) {
    walk(value);
  }
  template <class T>
  void walk(T& x) {
    if constexpr (requires(Scene & s) { pool(s, x); })
      on_index_(x);
    else if constexpr (requires { x.has_value(); }) {
      if (x) walk(*x);
    } else if constexpr (requires { x.index(); })
      std::visit([&](auto& alternative) { describe(*this, alternative); }, x);
    else if constexpr (Described<T>)
      describe(*this, x);
    else if constexpr (requires { x.begin(); })
      for (auto& one : x) walk(one);
  }

 private:
  F on_index_;
};

}  // namespace ls::scene
