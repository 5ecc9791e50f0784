#include "core/scene/json/serialize.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <variant>

#include "core/base/check.h"
#include "core/scene/schema/describe_fields.h"
#include "core/scene/schema/validate.h"

namespace ls {
namespace scene {
namespace {

using Json = nlohmann::json;

// Fills one object from its JSON. Records the first error, with its path in the JSON, and ignores everything
// after it.
class ObjectReader {
 public:
  ObjectReader(const Json& json, std::string path, std::string& wrong)
      : json_(json), path_(std::move(path)), wrong_(wrong) {
    if (!json.is_object()) fail("", "is not an object");
  }

  template <class T>
  void field(const Field& f, T& value) {
    if (!wrong_.empty()) return;
    seen_.emplace(f.name);
    const auto it = json_.find(std::string(f.name));
    if (it == json_.end()) return f.elided ? void() : fail(f.name, "is missing");
    read(f, *it, value);
    // Each scene has exactly one canonical form. So a field must be absent if it has the default that the
    // writer leaves out.
    if (wrong_.empty() && f.leaves_out(value)) fail(f.name, "has the value that is left out");
  }

  std::string type() {
    seen_.insert("type");
    const auto it = json_.is_object() ? json_.find("type") : json_.end();
    if (it != json_.end() && it->is_string()) return it->get<std::string>();
    fail("type", "is missing");
    return {};
  }

  void finish() {
    if (!wrong_.empty()) return;
    for (const auto& [key, value] : json_.items())
      if (!seen_.contains(key)) return fail(key, "is unknown");
  }

 private:
  void fail(std::string_view name, std::string_view what) {
    if (wrong_.empty())
      wrong_ = fmt::format("{}{}{} {}", path_, name.empty() ? "" : ".", name.substr(0, 64), what);
  }
  std::string below(std::string_view name) const { return fmt::format("{}.{}", path_, name); }

  bool number(const Field& f, const Json& j, double& x) {
    if (!j.is_number()) return fail(f.name, "is not a number"), false;
    x = j.get<double>();
    if (!std::isfinite(x) || !f.range.contains(x)) return fail(f.name, "is out of range"), false;
    return true;
  }
  void read(const Field& f, const Json& j, double& x) { number(f, j, x); }
  void read(const Field& f, const Json& j, int& x) {
    double d = 0;
    if (!j.is_number_integer()) return fail(f.name, "is not an integer");
    if (!number(f, j, d)) return;
    if (d < std::numeric_limits<int>::min() || d > std::numeric_limits<int>::max())
      return fail(f.name, "is out of range");
    x = static_cast<int>(d);
  }
  void read(const Field& f, const Json& j, std::uint64_t& x) {
    double d = 0;
    if (!j.is_number_unsigned()) return fail(f.name, "is not a count");
    if (number(f, j, d)) x = j.get<std::uint64_t>();
  }
  void read(const Field& f, const Json& j, bool& x) {
    if (!j.is_boolean()) return fail(f.name, "is neither true nor false");
    x = j.get<bool>();
  }
  void read(const Field& f, const Json& j, std::string& x) {
    if (!j.is_string()) return fail(f.name, "is not a string");
    x = j.get<std::string>();
    if (f.wrong && !x.empty())
      if (const std::string why = f.wrong(x); !why.empty()) fail(f.name, "is wrong: " + why);
  }
  void read(const Field& f, const Json& j, Digest& x) {
    const auto digest = j.is_string() ? Digest::parse(j.get_ref<const std::string&>()) : std::nullopt;
    if (!digest) return fail(f.name, "is not a digest of 64 hexadecimal digits");
    x = *digest;
  }
  void read(const Field& f, const Json& j, Transform& x) { read(f, j, x.m); }
  void read(const Field& f, const Json& j, UvTransform& x) { read(f, j, x.m); }
  template <class Tag>
  void read(const Field& f, const Json& j, Index<Tag>& x) {
    if (!j.is_number_unsigned() || j.get<std::uint64_t>() > 0xffffffffu)
      return fail(f.name, "is not an index");
    x.value = j.get<std::uint32_t>();
  }
  template <class E>
  requires std::is_enum_v<E>
  void read(const Field& f, const Json& j, E& x) {
    for (const auto& [name, value] : NamesOf<E>::all)
      if (j.is_string() && j.get_ref<const std::string&>() == name) {
        x = value;
        return;
      }
    fail(f.name, "is not one of its names");
  }
  template <class T>
  void read(const Field& f, const Json& j, std::optional<T>& x) {
    x.reset();
    if (!j.is_null()) read(f, j, x.emplace());
  }
  template <std::size_t N>
  void read(const Field& f, const Json& j, std::array<double, N>& x) {
    if (!j.is_array() || j.size() != N) return fail(f.name, fmt::format("is not a list of {} numbers", N));
    for (std::size_t i = 0; i < N; ++i)
      if (!number(f, j[i], x[i])) return;
  }
  void read(const Field& f, const Json& j, std::vector<double>& x) {
    if (!j.is_array() || j.size() > kMaxElements) return fail(f.name, "is not a list, or too long");
    x.resize(j.size());
    for (std::size_t i = 0; i < j.size(); ++i)
      if (!number(f, j[i], x[i])) return;
  }
  template <class T>
  void read(const Field& f, const Json& j, std::vector<T>& x) {
    if (!j.is_array() || j.size() > kMaxElements) return fail(f.name, "is not a list, or too long");
    x.clear();
    x.resize(j.size());
    for (std::size_t i = 0; i < j.size() && wrong_.empty(); ++i)
      read_object(j[i], fmt::format("{}[{}]", below(f.name), i), x[i]);
  }
  template <class... Ts>
  void read(const Field& f, const Json& j, std::variant<Ts...>& x) {
    read_object(j, below(f.name), x);
  }
  template <Described T>
  void read(const Field& f, const Json& j, T& x) {
    read_object(j, below(f.name), x);
  }

  template <Described T>
  void read_object(const Json& j, std::string path, T& x) {
    ObjectReader r(j, std::move(path), wrong_);
    describe(r, x);
    r.finish();
  }
  template <class... Ts>
  void read_object(const Json& j, std::string path, std::variant<Ts...>& x) {
    ObjectReader r(j, std::move(path), wrong_);
    const std::string type = r.type();
    if (!wrong_.empty()) return;
    const auto read = [&]<class Kind>() { describe(r, x.template emplace<Kind>()); };
    if (!with_kind_named<std::variant<Ts...>>(type, read)) r.fail("type", "is unknown");
    r.finish();
  }

  const Json& json_;
  std::string path_;
  std::string& wrong_;
  std::set<std::string, std::less<>> seen_;
};

bool too_deep(std::string_view json) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxJsonNesting) return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

void write_string(std::string& out, std::string_view text) {
  out += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\')
      (out += '\\') += c;
    else if (static_cast<unsigned char>(c) < 0x20)
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      out += c;
  }
  out += '"';
}

// One object of canonical JSON. Collects members as text and writes them sorted by name.
class JsonWriter {
 public:
  template <class T>
  void field(const Field& f, T& value) {
    if (f.leaves_out(value)) return;
    write(members_[std::string(f.name)], value);
  }
  void type(std::string_view name) { write_string(members_["type"], name); }
  std::string finish() const {
    std::string out = "{";
    for (const auto& [name, text] : members_) {
      if (out.size() > 1) out += ',';
      write_string(out, name);
      (out += ':') += text;
    }
    return out += '}';
  }

 private:
  static void write(std::string& out, double x) { out += shortest_number(x); }
  static void write(std::string& out, int x) { out += std::to_string(x); }
  static void write(std::string& out, std::uint64_t x) { out += std::to_string(x); }
  static void write(std::string& out, bool x) { out += x ? "true" : "false"; }
  static void write(std::string& out, const std::string& x) { write_string(out, x); }
  static void write(std::string& out, const Digest& x) { write_string(out, x.hex()); }
  static void write(std::string& out, const Transform& x) { write(out, x.m); }
  static void write(std::string& out, const UvTransform& x) { write(out, x.m); }
  template <class Tag>
  static void write(std::string& out, Index<Tag> i) {
    out += std::to_string(i.value);
  }
  template <class E>
  requires std::is_enum_v<E>
  static void write(std::string& out, E e) { write_string(out, name_of(e)); }
  template <class T>
  static void write(std::string& out, const std::optional<T>& x) {
    if (x)
      write(out, *x);
    else
      out += "null";
  }
  template <class... Ts>
  static void write(std::string& out, const std::variant<Ts...>& x) {
    std::visit(
        [&](const auto& alternative) {
          JsonWriter w;
          w.type(kInfo<std::remove_cvref_t<decltype(alternative)>>.name);
          describe(w, alternative);
          out += w.finish();
        },
        x);
  }
  template <Described T>
  static void write(std::string& out, const T& x) {
    JsonWriter w;
    describe(w, x);
    out += w.finish();
  }
  template <class List>
  requires requires(const List& list) { list.begin(); }
  static void write(std::string& out, const List& list) {
    out += '[';
    bool first = true;
    for (const auto& x : list) {
      if (!std::exchange(first, false)) out += ',';
      write(out, x);
    }
    out += ']';
  }

  std::map<std::string, std::string> members_;
};

}  // namespace

std::string shortest_number(double x) {
  CHECK(std::isfinite(x), "a scene with the number {} can't be written", x);
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, x == 0 ? 0.0 : x).ptr};
}

}  // namespace scene

Result<Scene> deserialize_scene(std::string_view text) {
  if (text.size() > scene::kMaxSceneJsonBytes)
    return fail(Errc::resource_exhausted,
                fmt::format("scene JSON is limited to {} MiB", scene::kMaxSceneJsonBytes >> 20));
  if (scene::too_deep(text)) return fail(Errc::invalid_argument, "scene JSON is nested too deep");
  const auto json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) return fail(Errc::invalid_argument, "scene JSON is malformed");
  Scene s;
  std::string wrong;
  scene::ObjectReader reader(json, "scene", wrong);
  scene::describe(reader, s);
  reader.finish();
  if (wrong.empty()) wrong = scene::find_inconsistency(s);
  if (!wrong.empty()) return fail(Errc::invalid_argument, wrong);
  return s;
}

std::string serialize(const Scene& s) {
  scene::JsonWriter w;
  scene::describe(w, s);
  return w.finish();
}

Digest digest_of(const Scene& s) { return sha256(serialize(s)); }

}  // namespace ls
