#include "formats/reader/params.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/base/text/suggest.h"
#include "core/scene/schema/materials.h"
#include "formats/reader/reader.h"
#include "formats/reader/unsupported.h"
#include "formats/xml/grammar.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

namespace ls::scene {
namespace {

constexpr double kLeastAlpha = 1e-4;  // as of the renderer and of Mitsuba: kMinAlpha in microfacet.h

}  // namespace

Params::Params(Reader& reader, const Element& object) : reader_(reader), object_(object) {
  std::map<std::string_view, const Element*> names;
  for (const Element& e : object.children) {
    if (reader.report().full()) return;  // further errors would not be shown
    const TagKind kind = kind_of(e);
    if (kind != TagKind::object && kind != TagKind::property && kind != TagKind::transform &&
        kind != TagKind::animation && kind != TagKind::reference)
      continue;
    Child c{&e, nullptr, e.get("name"), false};
    if (kind == TagKind::object) c.object = &e;
    if (kind == TagKind::reference && !(c.object = reader_.resolve(e))) c.taken = true;
    if (const auto [first, fresh] = names.emplace(c.name, &e); !fresh && !c.name.empty()) {
      const std::string where = reader_.report().refer_to(first->second->at, e.at);
      reader_.report().error(value_place(e, "name"),
                             fmt::format("{} is given '{}' twice; first in {}", title(), c.name, where));
      c.taken = true;
    }
    children_.push_back(c);
  }
}

std::string Params::title() const { return fmt::format("{} \"{}\"", object_.tag, object_.get("type")); }

bool Params::has(std::string_view name) const {
  return std::any_of(children_.begin(), children_.end(),
                     [&](const Child& c) { return c.name == name && !c.taken; });
}

const Element* Params::take(std::string_view name) {
  known_.emplace_back(name);
  for (Child& c : children_)
    if (c.name == name && !c.taken) {
      c.taken = true;
      return c.element;
    }
  return nullptr;
}

std::vector<Params::Nested> Params::take_nested(std::string_view tag, Names names) {
  std::vector<Nested> out;
  for (Child& c : children_)
    if (!c.taken && c.object && c.object->tag == tag && (names == Names::any || c.name.empty())) {
      c.taken = true;
      out.push_back({c.object, c.element});
    }
  return out;
}

std::optional<Params::Nested> Params::take_only(std::string_view tag, std::string_view owner,
                                                std::string_view kind) {
  const auto all = take_nested(tag);
  if (all.size() > 1) reader_.report().error(all[1].use->at, fmt::format("{} has a second {}", owner, kind));
  return all.empty() ? std::nullopt : std::optional(all[0]);
}

void Params::finish() {
  for (const Child& c : children_)
    if (!c.taken && !reader_.report().full()) left_over(c);
}

void Params::left_over(const Child& c) {
  const std::string_view plugin = object_.get("type");
  if (const auto because = meaningless_because(object_.tag, plugin, c.name);
      !c.name.empty() && !because.empty())
    return reader_.report().warning(
        value_place(*c.element, "name"),
        fmt::format("'{}' of {} has no effect here: {}", c.name, title(), because));
  if (c.name.empty())
    return reader_.report().error(c.element->at,
                                  fmt::format("{} has no use for a <{}> without a name", title(),
                                              c.object ? c.object->tag : c.element->tag));
  if (const auto instead = replacement(object_.tag, c.name); !instead.empty())
    return reader_.report().error(value_place(*c.element, "name"),
                                  fmt::format("{} has no parameter '{}': {}", title(), c.name, instead));
  // Suggests a supported parameter first, then one that would only cause a warning.
  std::string hint = suggestion(c.name, known_);
  if (const auto near = nearest_name(c.name, known_); !near)
    if (const auto other = nearest_name(c.name, meaningless_parameters(object_.tag, plugin)))
      hint = fmt::format("; did you mean '{}'?", *other);
  reader_.report().error(value_place(*c.element, "name"),
                         fmt::format("{} has no parameter '{}'{}", title(), c.name, hint));
}

void Params::missing(std::string_view name) {
  reader_.report().error(object_.at, fmt::format("{} needs '{}'", title(), name));
}

void Params::wrong_type(std::string_view name, const Element& e, std::string_view wanted) {
  const std::string given = kind_of(e) == TagKind::property
                                ? fmt::format("<{}> \"{}\"", e.tag, e.get("value"))
                                : fmt::format("<{}>", e.tag);
  reader_.report().error(e.find("value") ? value_place(e, "value") : e.at,
                         fmt::format("'{}' of {} wants {}, not {}", name, title(), wanted, given));
}

void Params::not_one_of(std::string_view name, const Element& e, const std::string& given,
                        const std::vector<std::string>& names) {
  reader_.report().error(value_place(e, "value"), fmt::format("'{}' of {} can't be \"{}\"{}", name, title(),
                                                              given, suggestion(given, names)));
}

bool Params::in_range(const Field& f, const Element& e, double x) {
  if (f.range.contains(x)) return true;
  // Many programs write 0 for a smooth surface. Mitsuba, too, reads it as its least roughness.
  if (x == 0 && f.name.starts_with("alpha")) {
    if (std::exchange(warned_of_, &e) != &e)
      reader_.report().warning(value_place(e, "value"),
                               fmt::format("'{}' of {} is 0, which is read as the least roughness, {}",
                                           f.name, title(), kLeastAlpha));
    return true;
  }
  reader_.report().error(value_place(e, "value"), fmt::format("'{}' of {} is {}, out of its range {}", f.name,
                                                              title(), x, range_text(f.name, f.range)));
  return false;
}

bool Params::in_range(const Field& f, const Element& e, const std::array<double, 3>& v) {
  return std::all_of(v.begin(), v.end(), [&](double x) { return in_range(f, e, x); });
}

std::optional<std::string> Params::string_value(std::string_view name, const Element& e) {
  if (e.tag == "string") return std::string(e.get("value"));
  wrong_type(name, e, "a <string>");
  return std::nullopt;
}

std::optional<std::string> Params::take_string(std::string_view name) {
  const Element* e = take(name);
  return e ? string_value(name, *e) : std::nullopt;
}

const Element* Params::take_animation(std::string_view name) {
  const auto of_name = [&](const Child& c) {
    return c.name == name && !c.taken && c.element->tag == "animation";
  };
  return std::any_of(children_.begin(), children_.end(), of_name) ? take(name) : nullptr;
}

std::optional<Transform> Params::take_transform(std::string_view name) {
  const Element* e = take(name);
  if (!e) return std::nullopt;
  Transform t;
  convert({.name = name, .doc = ""}, *e, t);
  return t;
}

void Params::convert(const Field& f, const Element& e, double& value) {
  if (f.named_ior && e.tag == "string") {
    if (const auto ior = named_ior(e.get("value"))) {
      value = *ior;
      return;
    }
    return not_one_of(f.name, e, std::string(e.get("value")), named_iors());
  }
  const auto number = e.tag == "float" || e.tag == "integer" ? parse_number(e.get("value")) : std::nullopt;
  if (!number)
    return wrong_type(f.name, e, f.named_ior ? "a <float> or the <string> name of a material" : "a <float>");
  if (!in_range(f, e, *number)) return;
  value = f.range.contains(*number) ? *number : kLeastAlpha;
}

void Params::convert(const Field& f, const Element& e, int& value) {
  const auto number = e.tag == "integer" ? parse_integer(e.get("value")) : std::nullopt;
  if (!number) return wrong_type(f.name, e, "an <integer>");
  const Field bounded{.name = f.name,
                      .doc = "",
                      .range = {std::max(f.range.min, -2147483648.0), std::min(f.range.max, 2147483647.0)}};
  if (in_range(bounded, e, static_cast<double>(*number))) value = static_cast<int>(*number);
}

void Params::convert(const Field& f, const Element& e, std::uint64_t& value) {
  const auto number = e.tag == "integer" ? parse_integer(e.get("value")) : std::nullopt;
  if (!number) return wrong_type(f.name, e, "an <integer>");
  if (in_range(f, e, static_cast<double>(*number))) value = static_cast<std::uint64_t>(*number);
}

void Params::convert(const Field& f, const Element& e, bool& value) {
  const auto given = e.tag == "boolean" ? parse_boolean(e.get("value")) : std::nullopt;
  if (!given) return wrong_type(f.name, e, "a <boolean>, true or false");
  value = *given;
}

void Params::convert(const Field& f, const Element& e, std::string& value) {
  auto text = string_value(f.name, e);
  if (!text) return;
  if (const std::string wrong = f.wrong ? f.wrong(*text) : ""; !wrong.empty())
    return reader_.report().error(value_place(e, "value"), wrong);
  if (f.wrong == wrong_link_list || f.wrong == wrong_link_sets) reader_.note_links(e, f.name, *text);
  value = std::move(*text);
}

void Params::convert(const Field& f, const Element& e, Vec3& value) {
  if (e.tag != "vector" && e.tag != "point") return wrong_type(f.name, e, "a <point> or <vector>");
  if (const auto v = read_xyz(e, 0, reader_.report()); v && in_range(f, e, *v)) value = *v;
}

void Params::convert(const Field& f, const Element& e, Rgb& value) {
  const Element* object = f.constvolume ? object_at(e) : nullptr;
  if (!object || object->tag != "volume") {
    if (const auto c = colour(f, e, f.constvolume ? "a colour or a constant <volume>" : "a colour"))
      value = *c;
    return;
  }
  const auto index = reader_.volume(*object, e);
  if (!index) return;
  const Rgb* constant = reader_.constant(*index);
  if (!constant)
    return reader_.report().error(e.at, fmt::format("'{}' of {} is the same everywhere: only a constvolume "
                                                    "will do; a grid belongs into a medium \"heterogeneous\"",
                                                    f.name, title()));
  if (in_range(f, e, *constant)) value = *constant;
}

void Params::convert(const Field& f, const Element& e, std::vector<double>& value) {
  const auto text = string_value(f.name, e);
  if (!text) return;
  const auto wrong = [&](std::string what) {
    reader_.report().error(value_place(e, "value"), fmt::format("'{}' of {} {}", f.name, title(), what));
  };
  constexpr std::string_view kBlank = " \t\r\n";
  std::vector<double> numbers;
  bool after_comma = true;  // a number has to follow
  for (std::size_t i = text->find_first_not_of(kBlank); i < text->size();
       i = text->find_first_not_of(kBlank, i)) {
    if ((*text)[i] == ',') {
      if (std::exchange(after_comma, true))
        return wrong(fmt::format("has a hole: number {} is missing", numbers.size() + 1));
      ++i;
      continue;
    }
    const std::size_t end = std::min(text->find_first_of(", \t\r\n", i), text->size());
    const std::string_view word = std::string_view(*text).substr(i, end - i);
    const auto number = parse_number(word);
    if (!number)
      return wrong(fmt::format("wants finite numbers, but number {} is \"{}\"", numbers.size() + 1,
                               word.substr(0, kMaxExcerptBytes)));
    if (!f.range.contains(*number))
      return wrong(fmt::format("has {} as number {}, out of its range {}", *number, numbers.size() + 1,
                               range_text(f.name, f.range)));
    numbers.push_back(*number);
    after_comma = false;
    i = end;
  }
  if (numbers.empty()) return wrong("has no numbers");
  if (after_comma) return wrong(fmt::format("has a hole: number {} is missing", numbers.size() + 1));
  value = std::move(numbers);
}

const Element* Params::object_at(const Element& e) {
  const TagKind kind = kind_of(e);
  return kind == TagKind::reference ? reader_.resolve(e) : kind == TagKind::object ? &e : nullptr;
}

void Params::convert(const Field& f, const Element& e, Transform& value) {
  if (e.tag == "animation")
    return reader_.report().error(
        e.at, fmt::format("'{}' of {} is an <animation>: only cameras, shapes and instances can move; give "
                          "a <transform>",
                          f.name, title()));
  if (e.tag != "transform") return wrong_type(f.name, e, "a <transform>");
  value = read_transform(e, reader_.report());
}

void Params::convert(const Field& f, const Element& e, UvTransform& value) {
  Transform t;
  convert(f, e, t);
  value = uv_part(t);
}

void Params::convert(const Field& f, const Element& e, AssetIndex& value) {
  const auto name = string_value(f.name, e);
  if (!name) return;
  if (const auto index = reader_.asset(*name, value_place(e, "value"))) value = *index;
}

void Params::convert(const Field& f, const Element& e, TextureIndex& value) {
  const Element* object = object_at(e);
  const bool spectrum = object && Reader::is_spectrum(*object);
  if (object && !spectrum && (object->tag == "texture" || object->tag == "spectrum")) {
    const auto index = reader_.texture(*object, e);
    if (!index) return;
    // The values of images are not known yet, so only textures with known bounds are checked.
    if (const auto& b = reader_.bounds(*index); b && !(in_range(f, e, b->low) && in_range(f, e, b->high)))
      return;
    value = *index;
  } else if (object && !spectrum) {
    reader_.report().error(e.at, fmt::format("'{}' of {} wants a colour or a texture, not a <{}>", f.name,
                                             title(), object->tag));
  } else if (const auto c = colour(f, e, "a colour or a texture")) {
    value = reader_.add_constant_texture(*c);
  }
}

void Params::convert(const Field& f, const Element& e, VolumeIndex& value) {
  const Element* object = object_at(e);
  if (object && object->tag == "volume") {
    const auto index = reader_.volume(*object, e);
    if (!index) return;
    if (const Rgb* constant = reader_.constant(*index); constant && !in_range(f, e, *constant)) return;
    value = *index;
  } else if (object && object->tag != "spectrum" && object->tag != "texture") {
    reader_.report().error(e.at, fmt::format("'{}' of {} wants a colour or a <volume>, not a <{}>", f.name,
                                             title(), object->tag));
  } else if (const auto c = colour(f, e, "a colour or a <volume>")) {
    value = reader_.add_constant_volume(*c);
  }
}

void Params::absent(const Field& f, TextureIndex& value) { value = reader_.add_constant_texture(f.fallback); }
void Params::absent(const Field& f, VolumeIndex& value) {
  if (f.required) return missing(f.name);
  value = reader_.add_constant_volume(f.fallback);
}

}  // namespace ls::scene
