#include "formats/xml/document.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace ls::scene {

const Attribute* Element::find(std::string_view attribute) const {
  const auto it = std::find_if(attributes.begin(), attributes.end(),
                               [&](const Attribute& a) { return a.name == attribute; });
  return it == attributes.end() ? nullptr : &*it;
}

std::string_view Element::get(std::string_view attribute) const {
  const Attribute* a = find(attribute);
  return a ? std::string_view(a->value) : std::string_view{};
}

Element made(std::string tag, std::string_view type, const Span& at) {
  Element e;
  e.tag = std::move(tag);
  e.at = at;
  if (!type.empty()) set(e, "type", std::string(type), at);
  return e;
}

void set(Element& e, std::string attribute, std::string value, const Span& at) {
  e.attributes.push_back({std::move(attribute), std::move(value), at, at});
}

void add(Element& parent, Element child) { parent.children.push_back(std::move(child)); }

void add(Element& parent, std::string tag, std::string name, std::string value, const Span& at) {
  Element property = made(std::move(tag), "", at);
  set(property, "name", std::move(name), at);
  set(property, "value", std::move(value), at);
  add(parent, std::move(property));
}

void add(Element& parent, std::string tag, std::string name, const Vec3& value, const Span& at) {
  add(parent, std::move(tag), std::move(name), fmt::format("{}", fmt::join(value, " ")), at);
}

void add(Element& parent, std::string name, double value, const Span& at) {
  add(parent, "float", std::move(name), fmt::format("{}", value), at);
}

void add(Element& parent, std::string name, const Rgb& value, const Span& at) {
  add(parent, "rgb", std::move(name), fmt::format("{}", fmt::join(value, " ")), at);
}

void add_as(Element& parent, const Element* property, std::string name) {
  if (!property) return;
  Element e = *property;
  if (e.tag == "color") e.tag = "rgb";
  for (Attribute& a : e.attributes)
    if (a.name == "name") a.value = name;
  add(parent, std::move(e));
}

void add_transform(Element& parent, const Element* transform, std::string name, std::vector<Element> before) {
  if (!transform && before.empty()) return;
  Element out = made("transform", "", transform ? transform->at : before.front().at);
  set(out, "name", std::move(name), out.at);
  out.children = std::move(before);
  if (transform)
    for (Element step : transform->children) {
      if (step.tag == "rotate")
        for (Attribute& a : step.attributes)
          if (a.name == "axis") a.name = "value";
      add(out, std::move(step));
    }
  add(parent, std::move(out));
}

Element matrix_step(const std::array<double, 16>& m, const Span& at) {
  Element step = made("matrix", "", at);
  set(step, "value", fmt::format("{}", fmt::join(m, " ")), at);
  return step;
}

void place(Element& parent, const Transform& to_world, const Span& at) {
  if (to_world != Transform{}) add_transform(parent, nullptr, "to_world", {matrix_step(to_world.m, at)});
}

std::size_t size_of(const Element& e) {
  std::size_t n = 1;
  for (const Element& child : e.children) n += size_of(child);
  return n;
}

}  // namespace ls::scene
