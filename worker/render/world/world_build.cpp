#include "worker/render/world/world_build.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/assets/image.h"
#include "core/image/aov/identifiers.h"
#include "core/scene/analysis/camera_view.h"
#include "core/scene/schema/integrators.h"
#include "core/scene/schema/validate.h"
#include "worker/render/base/build_stop.h"
#include "worker/render/geometry/coincident.h"
#include "worker/render/geometry/surface_boxes.h"
#include "worker/render/world/aim.h"
#include "worker/render/world/near_plane.h"
#include "worker/render/world/overlap.h"
#include "worker/render/world/world.h"

namespace ls::render {
namespace {

// Returns the features that a scene with the needs n requires of the integrator.
Features features_of(const scene::Needs& n) {
  return {.media = n.media,
          .grids = n.grids,
          .chromatic = n.chromatic,
          .emission = n.emission,
          .passing = n.boundaries || n.null_transmission,
          .visibility = n.flagged_shapes > 0 || n.ray_flags > 0 || n.linked_lights > 0,
          .phases = n.phases,
          .height = n.height,
          .motion = n.moving_shapes > 0};
}

// Returns the features that the finished world requires. Except for `overlaps` and `chromatic`, features_of()
// returns all of these for the scene's needs, and maybe more.
Features found_in(const World& w) {
  Features f;
  const auto& surfaces = w.geometry.surfaces;
  f.passing = std::any_of(surfaces.begin(), surfaces.end(),
                          [](const SurfaceInfo& s) { return s.null || s.null_transmission; });
  f.visibility = std::any_of(surfaces.begin(), surfaces.end(),
                             [](const SurfaceInfo& s) { return s.hidden.any() || s.holdout; });
  f.motion = !w.geometry.moving.empty();
  if (!w.use_media) return f;
  const auto use = [&](std::uint32_t i) {
    if (i == kNone) return;
    const Medium& m = w.media[i];
    const bool glows = m.emission_kind != EmissionKind::none;
    if (is_black(m.sigma_t) && !glows) return;
    f.media = true;
    f.emission = f.emission || glows;
    f.grids = f.grids || m.grid;
    f.chromatic = f.chromatic || m.chromatic();
    f.phases = f.phases || m.other_phases;
    f.height = f.height || m.height;
  };
  use(w.camera_medium);
  for (const MeterStart& m : w.meters.starts()) use(m.ambience);
  for (const SurfaceInfo& s : surfaces) {
    if (!s.transition) continue;
    use(s.interior);
    use(s.exterior);
  }
  f.overlaps = f.media && media_may_overlap(w);
  return f;
}

// Sets, for each surface, which data its hits must contain (uv, tangent, slopes) and which kinds of lobes its
// BSDF has. Also sets World::null_transmission.
void note_surface_needs(const Scene& scene, World& w) {
  for (std::size_t i = 0; i < w.geometry.surfaces.size(); ++i) {
    SurfaceInfo& s = w.geometry.surfaces[i];
    const auto& emitter = scene.shapes[i].emitter;
    s.wants_uv = w.bsdfs.reads_uv(s.bsdf) || (emitter && !w.textures.is_constant(emitter->radiance));
    // For the uv AOV, uv is computed only on meshes with uv, where this changes nothing else. On other shapes
    // it would rotate the shading frame, and so change the samples.
    s.wants_uv = s.wants_uv || (w.aovs.has(Aov::uv) && s.uvs);
    s.wants_tangent = w.bsdfs.anisotropic(s.bsdf);
    s.wants_slopes = w.bsdfs.reads_slopes(s.bsdf);
    s.smooth = w.bsdfs.has_smooth(s.bsdf);
    s.diffuse = w.bsdfs.is_diffuse(s.bsdf);
    w.null_transmission = w.null_transmission || s.null_transmission || (w.passing_counts && s.null);
  }
}

// Sets the Cryptomatte identifiers of shapes, materials and instances: from their names, or from their
// indices if the scene gives no names.
void name_surfaces(const Scene& scene, World& w) {
  const auto id = [](const std::vector<Label>& labels, std::size_t i, auto member,
                     std::string_view else_named) {
    return cryptomatte_id(i < labels.size() ? labels[i].*member : fmt::format("{}_{}", else_named, i));
  };
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    w.shape_ids.push_back(id(scene.shape_labels, i, &Label::name, "shape"));
    w.material_ids.push_back(id(scene.shape_labels, i, &Label::material, "material"));
  }
  for (std::size_t i = 0; i < scene.instances.size(); ++i)
    w.instance_ids.push_back(id(scene.instance_labels, i, &Label::name, "instance"));
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)  // those that move by themselves
    if (!scene.shapes[i].motion.empty()) w.instance_ids.push_back(w.shape_ids[i]);
}

// True if a point light is in a grid or beside it, at most a tenth of the grid's size away. Then equi-angular
// sampling is needed: close to the light the scattered light grows as 1 / distance^2, and free flights rarely
// end there.
bool a_point_shines_in_a_grid(const World& w) {
  const std::vector<V3> points = w.lights.points();
  return std::any_of(w.media.begin(), w.media.end(), [&](const Medium& m) {
    if (!m.grid || is_black(m.sigma_t)) return false;
    const V3 lo = m.density->domain_lo(), hi = m.density->domain_hi(), margin = (hi - lo) * .1f;
    return std::any_of(points.begin(), points.end(), [&](const V3& p) {
      const V3 q = m.density->to_index(p);
      for (int k = 0; k < 3; ++k) {
        if (!(q[k] >= lo[k] - margin[k] && q[k] <= hi[k] + margin[k])) return false;
      }
      return true;
    });
  });
}

// Sets what the world knows of links between lights and what they light or what shades them.
void link(const Scene& scene, World& w) {
  const scene::LinkLists lists(scene);
  for (const Shape& s : scene.shapes) w.surface_links.push_back(lists.having(s.link_sets));
  w.surface_links.resize(w.geometry.surfaces.size(), lists.having(""));  // the plate of meters is in no set
  for (const ls::Medium& m : scene.media)
    w.medium_links.push_back(lists.having(std::visit([](const auto& x) { return x.link_sets; }, m)));
  w.shadow_lists = w.lights.blockers_of_extended();
  if (w.direct_by_shadows) w.shadow_lists.push_back(scene::kEverything);
  w.shadows_walk = std::ranges::any_of(
      w.geometry.surfaces, [](const SurfaceInfo& s) { return s.hidden.has(RayKind::some_shadow); });
}

// Finds the regions inside media that contain no surfaces. There a flight may be sampled first, and its ray
// has to be traced only if the flight leaves the region. With chromatic extinction this would be wrong, since
// the weight of a flight that reaches a surface depends on the distance to the surface.
void find_clear_regions(World& w) {
  // The largest number of bodies (surfaces that enclose a medium) for which regions are sought. Each search
  // examines all triangles and boxes, and where there are more bodies, each is so small a part of the scene
  // that its region saves little.
  constexpr int kMostBodies = 64;
  const auto wanted = [&](const SurfaceInfo& s) {
    if (!s.transition || s.interior == kNone || s.sheet || w.need.chromatic) return false;
    const Medium& m = w.media[s.interior];
    return !m.clear && m.emission_kind == EmissionKind::none && m.equiangular_mode == EquiangularMode::none;
  };
  const auto& surfaces = w.geometry.surfaces;
  const auto bodies = std::ranges::count_if(surfaces, wanted);
  if (bodies == 0 || bodies > kMostBodies) return;
  const auto boxes = surface_boxes(w.geometry, [](const SurfaceInfo&) { return true; });
  if (!boxes) return;
  for (std::uint32_t i = 0; i < surfaces.size(); ++i) {
    if (!wanted(surfaces[i])) continue;
    if (const auto region = ClearRegion::inside(w.geometry, i, *boxes, w.overlaps))
      w.media[surfaces[i].interior].clear = &w.clear_regions.emplace_back(*region);
  }
}

// Sets the camera and the position of the image in the full frame; returns the size of the full frame. If the
// scene has a crop, the image is that part of the full frame, with the same pixel values, bit for bit, as in
// an image of the full frame.
FrameSize place_camera(const Scene& scene, const RenderSettings& settings, World& w) {
  const scene::FramePart part = scene::frame_part(scene.film, settings.size);
  w.origin_x = part.x0;
  w.origin_y = part.y0;
  if (w.meters.any())
    w.camera = Camera(w.meters, *w.meter_world);
  else
    w.camera = Camera(scene.sensor, part.frame, w.geometry.center, w.geometry.scale, &w.textures);
  return part.frame;
}

Result<void> check_indices(const Scene& scene) {
  const auto bad = [](std::uint32_t i, std::size_t n) { return i >= n; };
  for (const Shape& s : scene.shapes) {
    if (bad(s.bsdf.value, scene.bsdfs.size()) || (s.interior && bad(s.interior->value, scene.media.size())) ||
        (s.exterior && bad(s.exterior->value, scene.media.size())) ||
        (s.emitter && bad(s.emitter->radiance.value, scene.textures.size()))) {
      return fail(Errc::invalid_argument,
                  "a shape refers to a material, medium or texture that the scene does not have");
    }
  }
  if (scene.sensor.aperture_scale && bad(scene.sensor.aperture_scale->value, scene.textures.size()))
    return fail(Errc::invalid_argument, "the sensor refers to a texture that the scene does not have");
  if (scene.sensor.medium && bad(scene.sensor.medium->value, scene.media.size())) {
    return fail(Errc::invalid_argument, "the sensor refers to a medium that the scene does not have");
  }
  return {};
}

// Returns the scene with the white material of the plates of meters, its last.
Scene with_plates(Scene scene) {
  scene.textures.emplace_back(ConstantTexture{{1, 1, 1}});
  scene.bsdfs.emplace_back(DiffuseBsdf{{static_cast<std::uint32_t>(scene.textures.size() - 1)}});
  return scene;
}

// Sets the meters of a scene that with_plates() returned. The accelerator must exist.
Result<void> build_meters(const Scene& scene, World& w) {
  w.meter_world.emplace(w.geometry, w.textures);
  const BsdfIndex white{static_cast<std::uint32_t>(scene.bsdfs.size() - 1)};
  auto meters =
      Meters::build(scene, std::get<DiffuseBsdf>(scene.bsdfs[white.value]).reflectance, *w.meter_world);
  if (!meters) return tl::unexpected(meters.error());
  w.meters = std::move(*meters);
  SurfaceInfo plate{.bsdf = white, .plain = true, .wants_uv = false, .wants_tangent = false, .diffuse = true};
  w.plate = static_cast<std::uint32_t>(w.geometry.surfaces.size());
  w.geometry.surfaces.push_back(plate);
  // The way from the plate is the first segment of what a meter sees.
  if (w.max_depth >= 0) ++w.max_depth;
  ++w.rr_depth;
  return {};
}

Result<void> check_meters(const Scene& scene, const RenderSettings& settings) {
  const std::size_t meters = scene::meter_count(scene);
  if (meters != static_cast<std::size_t>(settings.meters))
    return fail(Errc::invalid_argument,
                fmt::format("the scene has {} meters, and the settings have {}", meters, settings.meters));
  if (meters > 0 && settings.size != scene.film.size)
    return fail(Errc::invalid_argument, "the size of the image is not that of the scene's meters");
  return {};
}

}  // namespace

Result<std::shared_ptr<World>> make_world(const Scene& given, const RenderSettings& settings,
                                          const AssetFiles& files, int threads) {
  const std::optional<Scene> with_meters =
      given.meters.empty() ? std::nullopt : std::optional(with_plates(given));
  const Scene& scene = with_meters ? *with_meters : given;
  if (auto ok = check_indices(scene); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_meters(scene, settings); !ok) return tl::unexpected(ok.error());
  if (settings.size.width < 1 || settings.size.height < 1)
    return fail(Errc::invalid_argument, "the film has no pixels");
  const auto world = std::make_shared<World>();
  World& w = *world;
  const AssetLoader loader{scene, files};
  w.seed = settings.seed;
  w.aovs = aovs_of(settings);
  w.size = settings.size;
  w.max_depth = settings.max_depth;
  w.rr_depth = settings.rr_depth;
  w.use_media = scene::sees_media(settings.integrator);
  w.passing_counts = !w.use_media && settings.max_depth >= 0;
  w.distant_mis = settings.integrator == "volpath_distant_mis";
  if (w.distant_mis) {
    w.distance = scene.integrator.distance;
    w.heuristic = scene.integrator.heuristic;
  }
  w.hide_emitters = scene.integrator.hide_emitters;
  w.transparent = scene.film.transparent;
  auto geometry = Geometry::build(scene, loader);
  if (!geometry) return tl::unexpected(geometry.error());
  w.geometry = std::move(*geometry);
  w.inputs.add(HealthCause::degenerate_triangle, w.geometry.dropped_triangles);
  w.inputs.add(HealthCause::wrong_texture_coordinates, w.geometry.wrong_uv_faces);
  w.inputs.add(HealthCause::negative_texel, w.geometry.attributes.clamped);
  const auto load = [&](const Asset& a, auto... most_pixels) -> Result<ImageData> {
    if (auto ok = BuildStop::go_on(); !ok) return tl::unexpected(ok.error());
    const auto it = files.find(a.digest);
    if (it == files.end()) return fail(Errc::internal, "no file was given for '" + a.name + "'");
    return load_image(it->second, a.name, most_pixels...);
  };
  auto textures = TextureTable::build(scene, load, {&w.geometry.attributes, w.geometry.indices});
  if (!textures) return tl::unexpected(textures.error());
  w.textures = std::move(*textures);
  auto bsdfs = BsdfTable::build(scene, w.textures);
  if (!bsdfs) return tl::unexpected(bsdfs.error());
  w.bsdfs = std::move(*bsdfs);
  w.inputs.add(HealthCause::negative_texel, w.textures.clamped_texels());
  w.inputs.add(HealthCause::reflectance, w.bsdfs.clamped_inputs());
  note_surface_needs(scene, w);
  if (w.use_media) {
    if (auto ok = build_media(scene, loader, w); !ok) return tl::unexpected(ok.error());
    for (std::size_t i = 0; i < w.media.size(); ++i)
      w.media[i].light_group =
          std::visit([&](const auto& m) { return light_group_of(settings.light_groups, m.light_group); },
                     scene.media.at(i));
    if (scene.sensor.medium) w.camera_medium = scene.sensor.medium->value;
  }
  if (auto ok = BuildStop::go_on(); !ok) return tl::unexpected(ok.error());
  w.coincident = find_coincident(w.geometry).any;
  if (auto ok = BuildStop::go_on(); !ok) return tl::unexpected(ok.error());
  auto lights = Lights::build(
      scene, w.geometry, w.textures,
      [&](const Asset& a) {
        auto image = load(a, kMaxEnvironmentPixels);
        if (!image && image.error().code == Errc::resource_exhausted)
          image.error().message += "; scale the environment map down to 8192 x 4096 pixels or less";
        return image;
      },
      settings.light_groups);
  if (!lights) return tl::unexpected(lights.error());
  w.lights = std::move(*lights);
  w.hide_environment = w.hide_emitters || w.transparent || w.lights.hides_environment();
  w.inputs.add(HealthCause::negative_texel, w.lights.clamped_inputs());
  for (SurfaceInfo& s : w.geometry.surfaces) {
    s.transition = s.transition && w.use_media;
    s.borders = s.transition || s.coincident_reach > 0;
    s.plain = s.light == kNone && !s.null && !s.null_transmission;
    w.lights_on_others = w.lights_on_others || (s.passable && s.light != kNone && s.coincident_reach > 0);
  }
  auto accel = Accel::build(w.geometry, threads, w.coincident);
  if (!accel) return tl::unexpected(accel.error());
  w.accel = std::move(*accel);
  if (!scene.meters.empty())
    if (auto ok = build_meters(scene, w); !ok) return tl::unexpected(ok.error());
  w.frame = place_camera(scene, settings, w);
  if (!w.camera.usable())
    return fail(Errc::invalid_argument,
                "the rays of the sensor leave the range of single precision: check its to_world, fov, "
                "principal_point_offset, clip planes, aperture_radius and focus_distance");
  w.moves = w.camera.moves() || !w.geometry.moving.empty();
  w.filter = PixelFilter(scene.film.filter);
  w.hidden_boundaries = near_plane_hides_boundaries(w);
  if (auto ok = check_way_of_camera(w); !ok) return tl::unexpected(ok.error());
  const Features found = found_in(w);
  w.needs = scene::needs_of(scene, w.use_media);
  w.need = features_of(w.needs);
  w.need.whitted = settings.integrator == scene::kWhitted;
  // The scene's description alone does not determine these two features: they also depend on the shapes in
  // mesh files, and on the number of channels (1 or 3) of the grids' files.
  w.need.overlaps = found.overlaps || w.coincident;
  w.need.chromatic = w.need.chromatic || found.chromatic;
  if (!w.need.covers(found))
    return fail(Errc::internal, "the scene's analysis left out something that the scene has: this is a bug");
  w.overlaps = found.overlaps;
  if (w.overlaps) w.camera_media = camera_media(w);
  if (w.need.media) place_meters(w);
  const DeepSlices deep = w.aovs.deep();
  w.need.split = w.aovs.any_of(aovs_of(AovKind::light)) || w.aovs.any_of(aovs_of(AovKind::groups)) ||
                 (deep.count > 0 && deep.colours);
  if (w.aovs.any_of(aovs_of(AovKind::ids))) name_surfaces(scene, w);
  bool homogeneous_media = false;
  for (const Medium& m : w.media) homogeneous_media = homogeneous_media || (!m.grid && !is_black(m.sigma_t));
  w.ray_flags = w.needs.ray_flags > 0 || w.needs.linked_lights > 0;
  w.direct_by_shadows = std::ranges::any_of(w.geometry.surfaces, [&](const SurfaceInfo& s) {
    const bool shadow = s.hidden.has(RayKind::shadow);
    return s.hidden.has(RayKind::surface) != shadow || s.hidden.has(RayKind::medium) != shadow;
  });
  link(scene, w);
  w.shadows_walk = w.shadows_walk || w.null_transmission || (w.need.media && w.accel.has_boundaries());
  const bool segments = w.distant_mis || scene.integrator.equiangular == 0;
  w.equiangular = segments && w.need.media && homogeneous_media && w.lights.any_with_place();
  w.equiangular_points =
      segments && w.need.grids && (w.equiangular || !w.lights.has_tree()) && a_point_shines_in_a_grid(w);
  for (Medium& m : w.media) {
    if (m.grid ? w.equiangular_points : w.equiangular)
      m.equiangular_mode = m.grid ? EquiangularMode::points : EquiangularMode::places;
  }
  find_clear_regions(w);
  // Equi-angular sampling chooses a light for a segment before the shading point is known, so it cannot use
  // the light tree, whose choice depends on the point. Multiple importance sampling combines it with
  // next-event estimation at vertices, which must choose each light with the same probability. So points in
  // media use the tree only if segments are not sampled.
  if (!w.equiangular && !w.equiangular_points && settings.integrator != "volpath_distant_mis")
    w.lights.use_tree_in_media();
  aim(scene.integrator, w);
  return world;
}

}  // namespace ls::render
