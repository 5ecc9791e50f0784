// Translates the objects of a Nori file to elements of Mitsuba's format.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/nori/words.h"
#include "formats/xml/document.h"
#include "formats/xml/grammar.h"
#include "formats/xml/source_text.h"

namespace ls::scene::nori {

TagKind object_kind(const Element& e);
// Checks elements, their attributes and nesting; false if errors were reported.
bool check_objects(const Element& root, Report& report);

// Returns the row for the type of `e` in the table of Nori's object types. If the type is unknown or
// unsupported, reports this and returns nullptr; for an unknown type the message has a suggestion.
const Plugin* known_plugin(const Element& e, Report& report);

// Returns a colour of three numbers, or a grey of one.
Rgb rgb_of(const std::vector<double>& numbers);

// One object of a Nori file. Its parameters are taken by name and checked against the table of parameters;
// finish() reports those that are not taken.
class Object {
 public:
  Object(const Element& e, const Plugin& plugin, Report& report);

  const Element& element() const { return e_; }
  std::string title() const;  // for example: bsdf "microfacet"
  std::string_view type() const { return plugin_.type; }
  bool has(std::string_view parameter) const;

  // Returns the element that sets the parameter. nullptr: there is none, or it is wrong, which is reported.
  const Element* take(std::string_view parameter);
  double number(std::string_view parameter, double fallback);
  Rgb color(std::string_view parameter, const Rgb& fallback);
  Vec3 triple(std::string_view parameter, const Vec3& fallback);
  std::string_view text(std::string_view parameter, std::string_view fallback);
  void missing(std::string_view parameter);
  // True if both parameters are given; this is reported as an error.
  bool both(std::string_view one, std::string_view other);

  // Returns the nested objects with this tag that have not been taken yet, and marks them as taken.
  std::vector<const Element*> nested(std::string_view tag);
  // Returns the nested object with this tag, or nullptr if there is none; a second one is reported.
  const Element* only(std::string_view tag);
  void finish();
  // To be called instead of finish() for an object of an unsupported type: reports only the parameters that
  // this type does not have.
  void finish_refused();

 private:
  struct Child {
    const Element* e;
    bool taken = false;
  };
  bool fits(const Parameter& p, const Element& e);
  bool in_range(const Parameter& p, const Element& e, const std::vector<double>& values);
  bool knows(std::string_view parameter) const;
  void left_over(const Child& c);
  void idle_object(const Element& e);

  const Element& e_;
  const Plugin& plugin_;
  Report& report_;
  std::vector<Child> children_;
};

// Each of the functions below translates one kind of object. It returns nullopt if the object cannot be
// translated, which has been reported.

// Properties of a mesh on which its nested objects may depend.
struct Mesh {
  bool sphere = false;
  // Corners of the mesh's bounding box; nullopt: the box is unknown, since the mesh is in a file.
  std::optional<Vec3> low, high;
};

std::optional<Element> bsdf(const Element& e, const Mesh& mesh, Report& report);
// Translates a bsdf's parameter, which is a colour or a <texture>, to an element called `name`.
std::optional<Element> texture(const Element& given, std::string name, const Mesh& mesh, Report& report);

std::optional<Element> medium(const Element& e, const Mesh& mesh, Report& report);

// emitter() translates an emitter that is a child of the scene; mesh_emitter() translates one that is nested
// in a mesh.
std::optional<Element> emitter(const Element& e, Report& report);
std::optional<Element> mesh_emitter(const Element& e, Report& report);

// Translates a camera to a <sensor> with film and sampler; `sampler` may be nullptr.
std::optional<Element> camera(const Element& e, const Element* sampler, Report& report);

struct Integrator {
  Element element;
  // An option of Kombu, a descendant of Nori: true if the camera is in the medium of the mesh that surrounds
  // the camera.
  bool inmedium = false;
};
std::optional<Integrator> integrator(const Element& e, Report& report);

}  // namespace ls::scene::nori
