#include "common/scene/nori/object.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/suggest.h"
#include "common/scene/limits.h"
#include "common/scene/xml/transform_element.h"
#include "common/scene/xml/values.h"

namespace ls::scene::nori {
namespace {

unsigned type_of(const Element& e) {
  static constexpr std::pair<std::string_view, unsigned> kTags[] = {
      {"float", kFloat},     {"integer", kInteger}, {"boolean", kBoolean}, {"string", kString},
      {"color", kColor},     {"point", kPoint},     {"vector", kVector},   {"transform", kTransform},
      {"texture", kTexture}, {"volume", kVolume},   {"bsdf", kBsdf}};
  for (const auto& [tag, type] : kTags)
    if (tag == e.tag) return type;
  return 0;
}

std::string described(const Element& e) {
  return e.find("value") ? fmt::format("<{}> \"{}\"", e.tag, e.get("value")) : fmt::format("<{}>", e.tag);
}

// Returns the values in a property of this tag; nullopt: they cannot be parsed.
std::optional<std::vector<double>> values_of(const Element& e) {
  const std::string_view text = e.get("value");
  if (e.tag == "float") {
    const auto x = parse_number(text);
    return x ? std::optional(std::vector{*x}) : std::nullopt;
  }
  if (e.tag == "integer") {
    const auto x = parse_integer(text);
    return x ? std::optional(std::vector{static_cast<double>(*x)}) : std::nullopt;
  }
  auto numbers = parse_numbers(text, 3);
  if (!numbers) return std::nullopt;
  // Two numbers are a pair of values for u and v.
  const bool pair = (e.tag == "point" || e.tag == "vector") && numbers->size() == 2;
  if (numbers->size() != 3 && !pair) return std::nullopt;
  return numbers;
}

}  // namespace

const Plugin* known_plugin(const Element& e, Report& report) {
  const std::string_view type = e.get("type");
  if (const Plugin* p = find_plugin(e.tag, type)) return p;
  const std::vector<std::string> names = plugin_names(e.tag);
  if (const auto because = refused_because(e.tag, type); !because.empty())
    report.error(value_place(e, "type"),
                 fmt::format("the {} \"{}\" is not supported: {}", e.tag, type, because));
  else
    report.error(value_place(e, "type"),
                 fmt::format("Nori has no {} \"{}\"{}", e.tag, type, suggestion(type, names)));
  return nullptr;
}

Object::Object(const Element& e, const Plugin& plugin, Report& report)
    : e_(e), plugin_(plugin), report_(report) {
  if (e.children.size() > kMaxObjectChildren) {
    report_.error(e.at, fmt::format("{} has {} elements in it; {} are allowed", title(), e.children.size(),
                                    kMaxObjectChildren));
    return;
  }
  std::map<std::string_view, const Element*> names;
  for (const Element& child : e.children) {
    if (report_.full()) return;  // further errors would not be shown
    const std::string_view name = child.get("name");
    const auto [first, fresh] = names.emplace(name, &child);
    const bool again = !fresh && !name.empty();
    if (again)
      report_.error(value_place(child, "name"),
                    fmt::format("{} is given '{}' twice; first in {}", title(), name,
                                report_.refer_to(first->second->at, child.at)));
    children_.push_back({&child, again});
  }
}

std::string Object::title() const { return fmt::format("{} \"{}\"", e_.tag, plugin_.type); }

bool Object::has(std::string_view parameter) const {
  return std::any_of(children_.begin(), children_.end(),
                     [&](const Child& c) { return !c.taken && c.e->get("name") == parameter; });
}

const Element* Object::take(std::string_view parameter) {
  const auto child = std::find_if(children_.begin(), children_.end(),
                                  [&](const Child& c) { return !c.taken && c.e->get("name") == parameter; });
  const auto row = std::find_if(plugin_.parameters.begin(), plugin_.parameters.end(),
                                [&](const Parameter& p) { return p.name == parameter; });
  if (child == children_.end() || row == plugin_.parameters.end()) return nullptr;
  child->taken = true;
  return fits(*row, *child->e) ? child->e : nullptr;
}

bool Object::fits(const Parameter& p, const Element& e) {
  const unsigned type = type_of(e);
  bool ok = (p.types & type) != 0;
  std::optional<std::vector<double>> values;
  if (ok && (type & (kFloat | kInteger | kColor | kPoint | kVector))) {
    values = values_of(e);
    ok = values.has_value();
  }
  if (ok && type == kBoolean) ok = parse_boolean(e.get("value")).has_value();
  if (!ok) {
    report_.error(
        e.find("value") ? value_place(e, "value") : e.at,
        fmt::format("'{}' of {} wants {}, not {}", p.name, title(), text_of(p.types), described(e)));
    return false;
  }
  return !values || in_range(p, e, *values);
}

bool Object::in_range(const Parameter& p, const Element& e, const std::vector<double>& values) {
  for (const double x : values)
    if (!p.range.contains(x)) {
      report_.error(value_place(e, "value"), fmt::format("'{}' of {} is {}, out of its range {}", p.name,
                                                         title(), x, range_text(p.name, p.range)));
      return false;
    }
  return true;
}

double Object::number(std::string_view parameter, double fallback) {
  const Element* e = take(parameter);
  return e ? values_of(*e)->front() : fallback;
}

Rgb Object::color(std::string_view parameter, const Rgb& fallback) {
  const Element* e = take(parameter);
  if (!e) return fallback;
  const auto v = *values_of(*e);
  return v.size() == 3 ? Rgb{v[0], v[1], v[2]} : Rgb{v[0], v[0], v[0]};
}

Vec3 Object::triple(std::string_view parameter, const Vec3& fallback) {
  const Element* e = take(parameter);
  if (!e) return fallback;
  const auto v = *values_of(*e);
  if (v.size() == 3) return {v[0], v[1], v[2]};
  report_.error(value_place(*e, "value"),
                fmt::format("'{}' of {} wants three numbers, not {}", parameter, title(), described(*e)));
  return fallback;
}

std::string_view Object::text(std::string_view parameter, std::string_view fallback) {
  const Element* e = take(parameter);
  return e ? e->get("value") : fallback;
}

void Object::missing(std::string_view parameter) {
  report_.error(e_.at, fmt::format("{} needs '{}'", title(), parameter));
}

bool Object::both(std::string_view one, std::string_view other) {
  if (!has(one) || !has(other)) return false;
  report_.error(e_.at, fmt::format("{} gives both {} and {}", title(), one, other));
  return true;
}

std::vector<const Element*> Object::nested(std::string_view tag) {
  std::vector<const Element*> out;
  for (Child& c : children_)
    if (!c.taken && c.e->tag == tag) {
      c.taken = true;
      out.push_back(c.e);
    }
  return out;
}

const Element* Object::only(std::string_view tag) {
  const auto all = nested(tag);
  if (all.size() > 1) report_.error(all[1]->at, fmt::format("{} has a second {}", title(), tag));
  return all.empty() ? nullptr : all[0];
}

void Object::finish() {
  for (const Child& c : children_)
    if (!c.taken && !report_.full()) left_over(c);
}

bool Object::knows(std::string_view parameter) const {
  return std::any_of(plugin_.parameters.begin(), plugin_.parameters.end(),
                     [&](const Parameter& p) { return p.name == parameter; });
}

void Object::finish_refused() {
  for (const Child& c : children_) {
    const std::string_view name = c.e->get("name");
    if (!c.taken && !name.empty() && !knows(name) && !report_.full()) left_over(c);
  }
}

void Object::left_over(const Child& c) {
  const std::string_view name = c.e->get("name");
  std::vector<std::string> names;
  for (const Parameter& p : plugin_.parameters) {
    if (p.name == name && !p.idle.empty())
      return report_.warning(value_place(*c.e, "name"),
                             fmt::format("'{}' of {} has no effect here: {}", name, title(), p.idle));
    // The parameter is known but was not taken: it has no meaning together with the other parameters.
    if (p.name == name)
      return report_.error(
          value_place(*c.e, "name"),
          fmt::format("'{}' of {} has no meaning beside its other parameters", name, title()));
    names.emplace_back(p.name);
  }
  if (name.empty() || object_kind(*c.e) == Kind::object)
    return report_.error(c.e->at, fmt::format("{} has no use for a <{}>{}", title(), c.e->tag,
                                              name.empty() ? "" : fmt::format(" called '{}'", name)));
  report_.error(value_place(*c.e, "name"),
                fmt::format("{} has no parameter '{}'{}", title(), name, suggestion(name, names)));
}

}  // namespace ls::scene::nori
