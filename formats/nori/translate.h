// Translates scenes of Nori and its descendants to Mitsuba 3, so that later stages have to handle only
// Mitsuba's format. Names, notations and defaults change; places in the source text are kept.
#pragma once

#include <optional>
#include <string_view>

#include "formats/xml/document.h"

namespace ls::scene::nori {

// True if this root element belongs to a Nori file: a <test>, or a <scene> that has a <camera> or a <mesh>.
// If it has a version, it must not have a <shape> or a <sensor> besides: these are Mitsuba's.
bool is_nori(const Element& root);

// Some descendants of Nori call a <mesh> a <shape>. Gives those in the <scene>s of this root the name <mesh>.
void rename_shapes(Element& root);

// Translates the document in place if it is a Nori file. Returns false if the file has errors, which were
// reported.
bool translate(Document& document, Report& report);

// Returns the equivalent <scene> of Mitsuba 3; nullopt: `scene` has errors, which were reported.
std::optional<Element> translate_scene(const Element& scene, Report& report);

// Returns a scene with one shape, a rectangle with normal +z, that has this bsdf.
std::optional<Element> translate_bsdf_alone(const Element& bsdf, Report& report);

}  // namespace ls::scene::nori
