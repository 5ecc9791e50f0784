// The tables of a job's settings and of what clients read generate parts of openapi.json and the reference
// page.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "coordinator/views/describe_change.h"
#include "coordinator/views/describe_view.h"
#include "core/job/objects.h"

namespace ls::http {
namespace {

using coordinator::JobChange;
using job::Setting;
using Json = nlohmann::ordered_json;

constexpr std::uint64_t kLargestExact = std::uint64_t{1} << 53;  // all smaller whole numbers are JavaScript's

template <class T>
Json schema_of(const Setting& s, const T& value) {
  if constexpr (requires { value.has_value(); }) {
    return schema_of(s, typename T::value_type{});
  } else if constexpr (std::is_enum_v<T>) {
    Json names = Json::array();
    for (const T one : offered(T{})) names.push_back(to_string(one));
    return {{"enum", names}};
  } else if constexpr (std::is_same_v<T, bool>) {
    return {{"type", "boolean"}};
  } else if constexpr (std::is_integral_v<T>) {
    Json schema{{"type", "integer"}, {"minimum", s.range.least}};
    if (s.range.most < kLargestExact) schema["maximum"] = s.range.most;
    return schema;
  } else if constexpr (std::is_same_v<T, double>) {
    return {{"type", "number"}, {"exclusiveMinimum", 0}, {"maximum", s.range.most}};
  } else if constexpr (std::is_same_v<T, job::Names>) {
    return {{"type", "array"}, {"maxItems", kMaxNames}, {"items", {{"type", "string"}}}};
  } else if constexpr (std::is_same_v<T, job::Defines>) {
    return {{"type", "object"}, {"additionalProperties", {{"type", "string"}}}};
  } else if constexpr (std::is_same_v<T, FrameSize>) {
    const Json side{{"type", "integer"}};
    return {{"type", "array"}, {"prefixItems", {side, side}}, {"minItems", 2}, {"maxItems", 2}};
  } else if constexpr (std::is_same_v<T, PixelRect>) {
    return {{"type", {"array", "null"}},
            {"items", {{"type", "integer"}, {"minimum", 0}}},
            {"minItems", 4},
            {"maxItems", 4}};
  } else {
    Json schema{{"type", "string"}};
    if constexpr (std::is_same_v<T, std::string>)
      if (s.range.most > 0) schema["minLength"] = s.range.least, schema["maxLength"] = s.range.most;
    if constexpr (std::is_same_v<T, FrameRange>) schema["pattern"] = "^[0-9]+(-[0-9]+(x[0-9]+)?)?$";
    if constexpr (std::is_same_v<T, Digest>) schema["pattern"] = "^[0-9a-f]{64}$";
    return schema;
  }
}

// Returns the schema of the text in a query.
template <class T>
Json query_schema_of(const Setting& s, const T& value) {
  const Json schema = schema_of(s, value);
  if constexpr (std::is_same_v<T, std::optional<FrameSize>>)
    return {{"type", "string"}, {"pattern", "^[0-9]+x[0-9]+$"}};
  else if (schema.contains("type") && (schema["type"] == "array" || schema["type"] == "object"))
    return {{"type", "string"}};
  return schema;
}

template <class T>
std::string form_in_query() {
  if (std::is_same_v<T, std::optional<FrameSize>>) return " WIDTHxHEIGHT.";
  if (std::is_same_v<T, job::Defines>) return " NAME=VALUE; may be repeated.";
  return std::is_same_v<T, job::Names> ? " Separated by commas." : "";
}

std::string sentences(const Setting& s) {
  std::string text(s.doc);
  if (s.choices) text += fmt::format(" Possible are {}.", s.choices());
  for (const std::string_view more : {s.more, s.who})
    if (!more.empty()) text += fmt::format(" {}", more);
  return text;
}

// Returns the JSON in one line, with blanks as openapi.json has them.
std::string in_a_line(const Json& json) {
  if (!json.is_structured()) return json.dump();
  std::string text;
  for (const auto& [key, value] : json.items())
    text += fmt::format("{}{}{}", text.empty() ? "" : ", ",
                        json.is_object() ? fmt::format("\"{}\": ", key) : "", in_a_line(value));
  return json.is_object() ? "{" + text + "}" : "[" + text + "]";
}

template <class T>
std::string properties_of(const std::string& indent, job::Chosen chosen = nullptr) {
  std::string lines;
  const T object;
  job::for_each_setting(object, [&](const Setting& s, const auto& value) {
    if (!job::is_chosen(chosen, s)) return;
    Json schema = schema_of(s, value);
    schema["description"] = sentences(chosen == job::goes_with_again ? job::described_for_again(s) : s);
    lines += fmt::format("{}{}\"{}\": {}", lines.empty() ? "" : ",\n", indent, s.name, in_a_line(schema));
  });
  return lines;
}

std::string query_parameters(const std::string& indent) {
  std::string lines;
  const JobSpec spec;
  job::for_each_setting(spec, [&]<class T>(const Setting& s, const T& value) {
    const Json parameter{{"name", s.query_name()},
                         {"in", "query"},
                         {"description", std::string(s.doc) + form_in_query<T>() + " See JobSpec."},
                         {"schema", query_schema_of(s, value)}};
    lines += indent + in_a_line(parameter) + ",\n";
  });
  return lines;
}

// Returns the name of the schema of a view that openapi.json refers to; empty: its schema stands in place.
template <class T>
std::string schema_name() {
  if (std::is_same_v<T, coordinator::TimeSplit>) return "TimeSplit";
  if (std::is_same_v<T, coordinator::FramesView>) return "Frames";
  return std::is_same_v<T, coordinator::HealthView> ? "Health" : "";
}

template <class T>
Json view_schema(const T& value);

struct SchemaWriter {
  Json properties = Json::object();
  template <class T>
  void field(const char* name, std::string_view doc, const T& value) {
    Json schema = view_schema(value);
    if (!doc.empty()) schema["description"] = doc;
    properties[name] = std::move(schema);
  }
  template <class T>
  void field_unless_empty(const char* name, std::string_view doc, const T& list) {
    field(name, doc, list);
  }
};

template <class T>
Json properties_of_view() {
  const T view{};
  SchemaWriter writer;
  describe(writer, view);
  return writer.properties;
}

// Returns the schema of a value of a field (coordinator/views/describe_view.h).
template <class T>
Json view_schema(const T& value) {
  if constexpr (requires { value.has_value(); }) {
    Json schema = view_schema(typename T::value_type{});
    if (!schema.contains("type")) return {{"oneOf", {schema, {{"type", "null"}}}}};
    schema["type"] = {schema["type"], "null"};
    return schema;
  } else if constexpr (std::is_same_v<T, bool>) {
    return {{"type", "boolean"}};
  } else if constexpr (std::is_arithmetic_v<T>) {
    return {{"type", std::is_integral_v<T> ? "integer" : "number"}};
  } else if constexpr (std::is_convertible_v<T, std::string_view>) {
    return {{"type", "string"}};
  } else if constexpr (std::is_same_v<T, coordinator::Word>) {
    return {{"enum", value.all}};
  } else if constexpr (std::is_same_v<T, coordinator::Interval>) {
    return {{"type", "array"}, {"items", {{"type", "number"}}}};
  } else if constexpr (requires { typename T::value_type; }) {
    return {{"type", "array"}, {"items", view_schema(typename T::value_type{})}};
  } else if (const std::string name = schema_name<T>(); !name.empty()) {
    return {{"$ref", "#/components/schemas/" + name}};
  } else if constexpr (!std::is_same_v<T, coordinator::HealthView>) {
    return {{"type", "object"}, {"properties", properties_of_view<T>()}};
  }
  return {};
}

template <class T>
std::string lines_of_view() {
  std::string lines;
  const Json properties = properties_of_view<T>();
  for (const auto& [name, schema] : properties.items())
    lines += fmt::format("{}          \"{}\": {}", lines.empty() ? "" : ",\n", name, in_a_line(schema));
  return lines;
}

// Replaces the part of `text` from the end of the last of `begins`, which follow each other, to `end`.
void replace_part(std::string& text, std::initializer_list<std::string> begins, const std::string& end,
                  const std::string& part) {
  std::size_t from = 0;
  for (const std::string& begin : begins) {
    from = text.find(begin, from);
    ASSERT_NE(from, text.npos) << begin;
    from += begin.size();
  }
  const std::size_t to = text.find(end, from);
  ASSERT_NE(to, text.npos) << end;
  text.replace(from, to - from, part);
}

std::string read_file(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void expect_committed(const std::string& name, const std::string& text) {
  const std::string path = LS_SOURCE_DIR "/" + name;
  if (std::getenv("LIGHTSHAFT_UPDATE_DOCS")) std::ofstream(path) << text;
  EXPECT_EQ(read_file(path), text)
      << "run LIGHTSHAFT_UPDATE_DOCS=1 http_api_test --gtest_filter='JobSettings.*' and commit the file";
}

std::string commands_with(const Setting& s) {
  if (s.option.empty()) return "";
  return fmt::format("`{}` of `submit`{}{}{}", s.option, s.render ? ", `render`" : "",
                     s.again ? ", `again`" : "", s.merge ? ", `merge`" : "");
}

template <class M>
std::string default_of(const Setting& s) {
  if constexpr (requires(M m) { m.has_value(); })
    return s.absent.empty() ? "none" : fmt::format("`{}`", s.absent);
  else
    return "`" + job::write(M{}).dump() + "`";
}

template <class M>
std::string values_of(const Setting& s) {
  if constexpr (requires(M m) { m.has_value(); })
    return values_of<typename M::value_type>(s);
  else
    return job::allowed<M>(s, job::Form::json) + (s.unit.empty() ? "" : fmt::format(" ({})", s.unit));
}

std::string page() {
  std::string text =
      "# Settings of a job\n\n"
      "Made from `core/job/describe.h` and `coordinator/views/describe_change.h` by "
      "`LIGHTSHAFT_UPDATE_DOCS=1 http_api_test --gtest_filter='JobSettings.*'`.\n\n"
      "## For a new job\n\n"
      "A client gives these settings in the object `spec` of the JSON that it sends to `POST /api/v1/jobs`, "
      "in "
      "`job.json` of an archive, or as parameters of the query; the commands `submit`, `render` and `again` "
      "have options for them. The query has the same names, except `define` (NAME=VALUE, may be repeated) "
      "for `defines`; it writes a list with commas and a size as WIDTHxHEIGHT.\n\n"
      "| setting | value in JSON | default | option | meaning |\n|---|---|---|---|---|\n";
  const JobSpec spec;
  job::for_each_setting(spec, [&]<class M>(const Setting& s, const M&) {
    text += fmt::format("| `{}` | {} | {} | {} | {} |\n", s.name, values_of<M>(s), default_of<M>(s),
                        commands_with(s), sentences(s));
  });
  text +=
      "\n## For a job that the coordinator has accepted\n\n"
      "The body of `PATCH /api/v1/jobs/ID` has at least one of these; either all changes are made or none. "
      "The commands `pause`, `resume`, `cancel`, `rename`, `priority`, `extend`, `after` and `focus` send "
      "them.\n\n"
      "| setting | value in JSON | meaning |\n|---|---|---|\n";
  const JobChange change;
  job::for_each_setting(change, [&]<class M>(const Setting& s, const M&) {
    text += fmt::format("| `{}` | {} | {} |\n", s.name, values_of<M>(s), sentences(s));
  });
  return text;
}

TEST(JobSettings, AreInTheOpenApiDocumentAsTheTablesSay) {
  std::string text = read_file(LS_SOURCE_DIR "/coordinator/http/openapi.json");
  const std::string properties = "        \"properties\": {\n";

  replace_part(text, {"\"operationId\": \"submitJob\"", "\"parameters\": [\n"},
               "          {\n            \"name\": \"name\",", query_parameters("          "));
  replace_part(text, {"\"operationId\": \"submitAgain\"", "\"properties\": {\n"}, "\n                }\n",
               properties_of<JobSpec>("                  ", job::goes_with_again));
  replace_part(text, {"\n      \"JobSpec\": {\n", properties}, "\n        }\n      }",
               properties_of<JobSpec>("          "));
  replace_part(text, {"\n      \"JobChange\": {\n", properties}, "\n        }\n      }",
               properties_of<JobChange>("          "));

  const auto replace_view = [&]<class T>(const char* name, std::type_identity<T>) {
    replace_part(text, {std::string("\n      \"") + name + "\": {\n", properties}, "\n        }\n      }",
                 lines_of_view<T>());
  };
  replace_view("Job", std::type_identity<coordinator::JobView>());
  replace_view("TimeSplit", std::type_identity<coordinator::TimeSplit>());
  replace_view("Frames", std::type_identity<coordinator::FramesView>());
  replace_view("Tile", std::type_identity<coordinator::TileView>());
  replace_view("Worker", std::type_identity<coordinator::WorkerView>());
  replace_view("Video", std::type_identity<coordinator::VideoView>());

  EXPECT_TRUE(Json::accept(text));
  expect_committed("coordinator/http/openapi.json", text);
}

TEST(JobSettings, AreOnTheReferencePageAsTheTablesSay) {
  expect_committed("docs/reference/job-settings.md", page());
}

}  // namespace
}  // namespace ls::http
