// Translates scenes of Nori and its descendants to Mitsuba 3, so that later stages know one dialect. Only
// names, notations and defaults are Nori's; source places are kept.
#pragma once

#include <optional>
#include <string_view>

#include "common/scene/xml/document.h"

namespace ls::scene::nori {

// True if this root belongs to a Nori file: a <test>, or a <scene> without version that has a <camera> or a
// <mesh>.
bool is_nori(const Element& root);

// Translates a document if it is a Nori file; false: it has errors, which were reported.
bool translate(Document& document, Report& report);

// The equivalent <scene> of Mitsuba 3; nullopt: it has errors, which were reported.
std::optional<Element> translate_scene(const Element& scene, Report& report);

// A scene with one shape, a rectangle with normal +z, that has this bsdf.
std::optional<Element> translate_bsdf_alone(const Element& bsdf, Report& report);

}  // namespace ls::scene::nori
