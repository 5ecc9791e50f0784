// Makes elements in Mitsuba's format. Readers of other formats translate to these, and the common reader
// (common/scene/reader) then checks types, ranges and references. A new element gets the place of the text
// from which it is made, for messages.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/xml/document.h"

namespace ls::scene {

Element made(std::string tag, std::string_view type, const Span& at);
void set(Element& e, std::string attribute, std::string value, const Span& at);
void add(Element& parent, Element child);
// Each adds a property. Numbers are written in the shortest form that reads back to the same bits.
void add(Element& parent, std::string tag, std::string name, std::string value, const Span& at);
void add(Element& parent, std::string name, double value, const Span& at);
void add(Element& parent, std::string name, const Rgb& value, const Span& at);
// Adds a copy of the property under another name.
void add_as(Element& parent, const Element* property, std::string name);
// Adds a <transform>: the steps `before`, followed by those of `transform`. Adds nothing if there are no
// steps at all.
void add_transform(Element& parent, const Element* transform, std::string name,
                   std::vector<Element> before = {});
// Adds the <transform> "to_world"; adds nothing if it is the identity.
void place(Element& parent, const Transform& to_world, const Span& at);
// Returns the number of elements: this one and all below it.
std::size_t size_of(const Element& e);
Element matrix_step(const std::array<double, 16>& m, const Span& at);

}  // namespace ls::scene
