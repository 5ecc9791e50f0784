#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>
#include <string>
#include <variant>

#include "common/base/check.h"
#include "common/base/overloaded.h"
#include "common/scene/json/serialize.h"
#include "common/scene/schema/describe_fields.h"

namespace ls {
namespace scene {
namespace {

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

// Writes the shortest text that reads back to the same bits. -0 is written as 0, so that equal numbers have
// equal texts.
void write_number(std::string& out, double x) {
  CHECK(std::isfinite(x), "a scene with the number {} can't be written", x);
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, x == 0 ? 0.0 : x).ptr;
  out.append(text, end);
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
  static void write(std::string& out, double x) { write_number(out, x); }
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
  static void write(std::string& out, E e) {
    for (const auto& [name, value] : NamesOf<E>::all)
      if (value == e) return write_string(out, name);
    CHECK(false, "an enumerator of value {} has no name", static_cast<int>(e));
  }
  template <class T>
  static void write(std::string& out, const std::optional<T>& x) {
    if (x)
      write(out, *x);
    else
      out += "null";
  }
  template <std::size_t N>
  static void write(std::string& out, const std::array<double, N>& x) {
    write_list(out, x);
  }
  template <class T>
  static void write(std::string& out, const std::vector<T>& x) {
    write_list(out, x);
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
  static void write_list(std::string& out, const List& list) {
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
}  // namespace scene

std::string serialize(const Scene& s) {
  scene::JsonWriter w;
  scene::describe(w, s);
  return w.finish();
}

Digest digest_of(const Scene& s) { return sha256(serialize(s)); }

}  // namespace ls
