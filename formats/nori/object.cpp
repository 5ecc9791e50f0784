#include "formats/nori/object.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/text/suggest.h"
#include "core/scene/limits.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

namespace ls::scene::nori {
namespace {

const std::vector<TagRow>& tags() {
  static const std::vector<TagRow> rows = [] {
    std::vector<TagRow> r;
    r.push_back({"scene", TagKind::object, {}, {"type", "id", "name"}});
    for (const char* tag : {"test", "mesh", "texture", "bsdf", "emitter", "camera", "medium", "phase",
                            "volume", "integrator", "sampler", "rfilter", "denoiser"})
      r.push_back({tag, TagKind::object, {"type"}, {"name", "id"}});
    for (const char* tag : {"boolean", "integer", "float", "string", "point", "vector", "color"})
      r.push_back({tag, TagKind::property, {"name", "value"}, {}});
    r.push_back({"transform", TagKind::transform, {"name"}, {}});
    for (const char* tag : {"translate", "scale", "matrix"}) r.push_back({tag, TagKind::step, {"value"}, {}});
    r.push_back({"rotate", TagKind::step, {"angle", "axis"}, {}});
    r.push_back({"lookat", TagKind::step, {"origin", "target", "up"}, {}});
    return r;
  }();
  return rows;
}

const TagRow* row_of(const Element& e) {
  for (const TagRow& row : tags())
    if (row.tag == e.tag) return &row;
  return nullptr;
}

// Returns a suggestion for an element that exists only in Mitsuba's format.
std::string_view instead(std::string_view tag) {
  static constexpr std::pair<std::string_view, std::string_view> kOthers[] = {
      {"sensor", "in Nori it is called <camera>"},
      {"film", "in Nori width and height stand in the <camera>"},
      {"rgb", "in Nori it is called <color>"},
      {"spectrum", "in Nori it is called <color>"},
      {"ref", "in Nori every object stands where it is used"},
  };
  for (const auto& [other, text] : kOthers)
    if (other == tag) return text;
  return {};
}

class NoriChecker {
 public:
  explicit NoriChecker(Report& report) : report_(report) {}

  // The depth of recursion is bounded by kMaxNesting.
  void check(const Element& e, const TagRow* parent) {
    if (report_.full()) return;
    const TagRow* row = row_of(e);
    if (!row) return unknown_tag(e);
    check_attributes(e, *row, report_);
    if (parent) check_parent(e, *row, *parent);
    if (row->kind == TagKind::step) check_step(e);
    for (const Element& child : e.children) check(child, row);
  }

 private:
  void unknown_tag(const Element& e) {
    if (const auto text = instead(e.tag); !text.empty())
      return report_.error(e.at, fmt::format("Nori has no element <{}>: {}", e.tag, text));
    std::vector<std::string> known;
    for (const TagRow& row : tags()) known.emplace_back(row.tag);
    const auto near = nearest_name(e.tag, known);
    report_.error(e.at, fmt::format("Nori has no element <{}>{}", e.tag,
                                    near ? fmt::format("; did you mean <{}>?", *near) : ""));
  }

  void check_parent(const Element& e, const TagRow& row, const TagRow& parent) {
    const bool step = row.kind == TagKind::step;
    if (step != (parent.kind == TagKind::transform))
      return report_.error(
          e.at, step ? fmt::format("<{}> is a step of a <transform> and can only stand in one", e.tag)
                     : fmt::format("<{}> can't stand in <{}>", e.tag, parent.tag));
    const bool nested_scene = e.tag == "scene" && parent.tag != "test";
    if ((parent.kind != TagKind::object && !step) || nested_scene || e.tag == "test")
      report_.error(e.at, fmt::format("<{}> can't stand in <{}>", e.tag, parent.tag));
  }

  void check_step(const Element& e) {
    if (e.tag == "matrix") return numbers(e, "value", 16);
    if (e.tag == "lookat")
      for (const char* attribute : {"origin", "target", "up"}) numbers(e, attribute, 3);
    if (e.tag == "translate" || e.tag == "scale") numbers(e, "value", 3);
    if (e.tag != "rotate") return;
    numbers(e, "angle", 1);
    numbers(e, "axis", 3);
    const auto axis = parse_numbers(e.get("axis"), 3);
    if (axis && std::all_of(axis->begin(), axis->end(), [](double x) { return x == 0; }))
      report_.error(value_place(e, "axis"), "<rotate> needs an axis that is not zero");
  }

  void numbers(const Element& e, std::string_view attribute, std::size_t count) {
    if (!e.find(attribute)) return;  // the missing attribute was reported
    const auto given = parse_numbers(e.get(attribute), count);
    if (given && given->size() == count) return;
    report_.error(value_place(e, attribute),
                  fmt::format("'{}' of <{}> wants {} number{}, not \"{}\"", attribute, e.tag, count,
                              count == 1 ? "" : "s", e.get(attribute)));
  }

  Report& report_;
};

}  // namespace

TagKind object_kind(const Element& e) {
  const TagRow* row = row_of(e);
  return row ? row->kind : TagKind::unknown;
}

bool check_objects(const Element& root, Report& report) {
  NoriChecker(report).check(root, nullptr);
  return !report.has_errors();
}

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

Rgb rgb_of(const std::vector<double>& v) {
  return v.size() == 3 ? Rgb{v[0], v[1], v[2]} : Rgb{v[0], v[0], v[0]};
}

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
  if (!ok)
    return report_.error(
               e.find("value") ? value_place(e, "value") : e.at,
               fmt::format("'{}' of {} wants {}, not {}", p.name, title(), text_of(p.types), described(e))),
           false;
  return !values || in_range(p, e, *values);
}

bool Object::in_range(const Parameter& p, const Element& e, const std::vector<double>& values) {
  for (const double x : values)
    if (!p.range.contains(x))
      return report_.error(value_place(e, "value"),
                           fmt::format("'{}' of {} is {}, out of its range {}", p.name, title(), x,
                                       range_text(p.name, p.range))),
             false;
  return true;
}

double Object::number(std::string_view parameter, double fallback) {
  const Element* e = take(parameter);
  return e ? values_of(*e)->front() : fallback;
}

Rgb Object::color(std::string_view parameter, const Rgb& fallback) {
  const Element* e = take(parameter);
  if (!e) return fallback;
  return rgb_of(*values_of(*e));
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

// An object that nothing here takes: it is of an unknown type, has not the name of its parameter, or belongs
// elsewhere.
void Object::idle_object(const Element& e) {
  const auto known = plugin_names(e.tag);
  if (e.find("type") && std::find(known.begin(), known.end(), e.get("type")) == known.end())
    return void(known_plugin(e, report_));
  std::vector<std::string> names;
  for (const Parameter& p : plugin_.parameters)
    if (p.types & type_of(e)) names.push_back(fmt::format("'{}'", p.name));
  std::string called;
  if (const std::string_view name = e.get("name"); !name.empty())
    called = fmt::format(" called '{}'", name);
  else if (!names.empty())
    called = " without a name";
  report_.error(e.at,
                fmt::format("{} has no use for a <{}>{}{}", title(), e.tag, called,
                            names.empty() ? "" : fmt::format(": call it {}", fmt::join(names, " or "))));
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
      return report_.error(value_place(*c.e, "name"),
                           fmt::format("'{}' of {} has no meaning here beside its other parameters: {}", name,
                                       title(), p.meaning));
    names.emplace_back(p.name);
  }
  if (name.empty() || object_kind(*c.e) == TagKind::object) return idle_object(*c.e);
  report_.error(value_place(*c.e, "name"),
                fmt::format("{} has no parameter '{}'{}", title(), name, suggestion(name, names)));
}

}  // namespace ls::scene::nori
