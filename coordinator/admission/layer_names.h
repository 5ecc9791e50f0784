// Finds the names in an image that come from the scene: those of light groups, and Cryptomatte manifests. A
// cryptomatte is an image layer that identifies the objects in each pixel; its manifest maps the identifiers
// to the names of the objects.
#pragma once

#include "core/image/aov/identifiers.h"
#include "core/image/exr/final_image.h"
#include "core/job/settings.h"
#include "core/scene/scene.h"

namespace ls::coordinator {

// True if the settings include cryptomattes, so that the scene must be read with labels (the names of its
// shapes and materials).
inline bool wants_labels(const RenderSettings& settings) {
  return aovs_of(settings).any_of(aovs_of(AovKind::ids));
}

inline LayerNames layer_names_of(const Scene& scene, AovSet aovs, std::vector<std::string> light_groups) {
  LayerNames out{.light_groups = std::move(light_groups)};
  std::vector<std::string> shapes, materials;
  for (std::size_t i = 0; i < scene.shape_labels.size(); ++i) {
    // A shape in a group (an object that is instanced) is not listed, since the image identifies the instance
    // of the group instead. The instances are added below.
    if (!scene.shapes[i].group) shapes.push_back(scene.shape_labels[i].name);
    materials.push_back(scene.shape_labels[i].material);
  }
  for (const Label& l : scene.instance_labels) shapes.push_back(l.name);
  if (aovs.has(Aov::shape_id)) out.shapes = cryptomatte_manifest(std::move(shapes));
  if (aovs.has(Aov::material_id)) out.materials = cryptomatte_manifest(std::move(materials));
  return out;
}
inline LayerNames layer_names_of(const Scene& scene, const RenderSettings& settings) {
  return layer_names_of(scene, aovs_of(settings), settings.light_groups);
}

}  // namespace ls::coordinator
