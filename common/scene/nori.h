// Scenes of Nori and its descendants in the words of Mitsuba 3: what follows knows one dialect. Only names,
// notations and defaults are Nori's; places in the file stay with what they belong to.
#pragma once

#include <optional>
#include <string_view>

#include "common/scene/document.h"

namespace ls::scene::nori {

// Whether this root is of a Nori file: a <test>, or a <scene> without version that has a <camera> or a
// <mesh>.
bool is_nori(const Element& root);

// Puts a document into Mitsuba's words if it is of a Nori file; false: it is wrong, which is reported.
bool translate(Document& document, Report& report);

// The same <scene> as Mitsuba 3 would have it; nothing if it is wrong, which is reported.
std::optional<Element> translate_scene(const Element& scene, Report& report);

// A scene whose one shape, a rectangle with normal +z, wears this bsdf.
std::optional<Element> translate_bsdf_alone(const Element& bsdf, Report& report);

}  // namespace ls::scene::nori
