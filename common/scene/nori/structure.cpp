// Checks the grammar of a whole Nori file before it is translated.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/suggest.h"
#include "common/scene/nori/object.h"
#include "common/scene/xml/transform_element.h"
#include "common/scene/xml/values.h"

namespace ls::scene::nori {
namespace {

struct TagRow {
  std::string_view tag;
  Kind kind;
  std::vector<std::string> required, optional;
};

const std::vector<TagRow>& tags() {
  static const std::vector<TagRow> rows = [] {
    std::vector<TagRow> r;
    r.push_back({"scene", Kind::object, {}, {"type", "id", "name"}});
    for (const char* tag : {"test", "mesh", "texture", "bsdf", "emitter", "camera", "medium", "phase",
                            "volume", "integrator", "sampler", "rfilter", "denoiser"})
      r.push_back({tag, Kind::object, {"type"}, {"name", "id"}});
    for (const char* tag : {"boolean", "integer", "float", "string", "point", "vector", "color"})
      r.push_back({tag, Kind::property, {"name", "value"}, {}});
    r.push_back({"transform", Kind::transform, {"name"}, {}});
    for (const char* tag : {"translate", "scale", "matrix"}) r.push_back({tag, Kind::step, {"value"}, {}});
    r.push_back({"rotate", Kind::step, {"angle", "axis"}, {}});
    r.push_back({"lookat", Kind::step, {"origin", "target", "up"}, {}});
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
      {"shape", "in Nori it is called <mesh>"},
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
    check_attributes(e, *row);
    if (parent) check_parent(e, *row, *parent);
    if (row->kind == Kind::step) check_step(e);
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

  void check_attributes(const Element& e, const TagRow& row) {
    std::vector<std::string> known = row.required;
    known.insert(known.end(), row.optional.begin(), row.optional.end());
    for (const Attribute& a : e.attributes) {
      if (report_.full()) return;
      if (std::find(known.begin(), known.end(), a.name) == known.end())
        report_.error(a.name_at,
                      fmt::format("<{}> has no attribute '{}'{}", e.tag, a.name, suggestion(a.name, known)));
    }
    for (const std::string& name : row.required)
      if (!e.find(name)) report_.error(e.at, fmt::format("<{}> needs the attribute '{}'", e.tag, name));
  }

  void check_parent(const Element& e, const TagRow& row, const TagRow& parent) {
    const bool step = row.kind == Kind::step;
    if (step != (parent.kind == Kind::transform))
      return report_.error(
          e.at, step ? fmt::format("<{}> is a step of a <transform> and can only stand in one", e.tag)
                     : fmt::format("<{}> can't stand in <{}>", e.tag, parent.tag));
    const bool nested_scene = e.tag == "scene" && parent.tag != "test";
    if ((parent.kind != Kind::object && !step) || nested_scene || e.tag == "test")
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
    if (!e.find(attribute)) return;  // already reported
    const auto given = parse_numbers(e.get(attribute), count);
    if (given && given->size() == count) return;
    report_.error(value_place(e, attribute),
                  fmt::format("'{}' of <{}> wants {} number{}, not \"{}\"", attribute, e.tag, count,
                              count == 1 ? "" : "s", e.get(attribute)));
  }

  Report& report_;
};

}  // namespace

Kind object_kind(const Element& e) {
  const TagRow* row = row_of(e);
  return row ? row->kind : Kind::unknown;
}

bool check_objects(const Element& root, Report& report) {
  NoriChecker(report).check(root, nullptr);
  return !report.has_errors();
}

}  // namespace ls::scene::nori
