// How the kinds of Nori's objects are put into Mitsuba's words. Each returns nothing if there is none, which
// was reported.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/scene/nori_object.h"

namespace ls::scene::nori {

// What stands in a mesh may depend on it.
struct Mesh {
  bool sphere = false;
  std::optional<Vec3> low, high;  // its bounding box, where it is known without reading files
};

std::optional<Element> bsdf(const Element& e, const Mesh& mesh, Report& report);
// A property or object `name` of a bsdf, from a colour or a <texture>.
std::optional<Element> texture(const Element& given, std::string name, const Mesh& mesh, Report& report);

std::optional<Element> medium(const Element& e, const Mesh& mesh, Report& report);

// Of a scene, or in a mesh.
std::optional<Element> emitter(const Element& e, Report& report);
std::optional<Element> mesh_emitter(const Element& e, Report& report);

// <sensor> with film and sampler; `sampler` may be nullptr.
std::optional<Element> camera(const Element& e, const Element* sampler, Report& report);

struct Integrator {
  Element element;
  bool inmedium = false;  // Kombu: the camera is in the medium of the mesh around it
};
std::optional<Integrator> integrator(const Element& e, Report& report);

}  // namespace ls::scene::nori
