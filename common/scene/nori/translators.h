// Translates the kinds of Nori's objects to Mitsuba. Each function returns nullopt if the object cannot be
// translated, which has been reported.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/scene/nori/object.h"

namespace ls::scene::nori {

// Properties of a mesh on which its nested objects may depend.
struct Mesh {
  bool sphere = false;
  std::optional<Vec3> low, high;  // its bounding box, if known without reading files
};

std::optional<Element> bsdf(const Element& e, const Mesh& mesh, Report& report);
// Translates a colour or a <texture> to a property or object called `name` of a bsdf.
std::optional<Element> texture(const Element& given, std::string name, const Mesh& mesh, Report& report);

std::optional<Element> medium(const Element& e, const Mesh& mesh, Report& report);

// Translate an emitter of the scene, and an emitter of a mesh.
std::optional<Element> emitter(const Element& e, Report& report);
std::optional<Element> mesh_emitter(const Element& e, Report& report);

// Translates a camera to a <sensor> with film and sampler; `sampler` may be nullptr.
std::optional<Element> camera(const Element& e, const Element* sampler, Report& report);

struct Integrator {
  Element element;
  // An option of Kombu, a descendant of Nori: the camera is in the medium of the mesh that surrounds it.
  bool inmedium = false;
};
std::optional<Integrator> integrator(const Element& e, Report& report);

}  // namespace ls::scene::nori
