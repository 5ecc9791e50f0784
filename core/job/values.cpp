#include "core/job/values.h"

#include <nlohmann/json.hpp>

namespace ls::job {
namespace {

constexpr std::size_t kMostShown = 80;  // a message quotes at most this many bytes of a wrong value

bool is_entry(const std::string& name, const std::string& value) {
  return !name.empty() && name.size() <= kMaxNameBytes && value.size() <= kMaxDefineBytes;
}

}  // namespace

std::string printable(std::string_view text, std::size_t most) {
  std::string out(text.substr(0, most));
  for (char& c : out)
    if (c < ' ' || c > '~') c = '?';
  if (text.size() > most) out += "...";
  return out;
}

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kMaxNameBytes && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.' || c == ':';
  });
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    if (end > 0) parts.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

std::string must_be(std::string_view allowed, std::string_view given) {
  // Quotes show an empty text, and blanks.
  const std::string_view quote = given.empty() || given.find(' ') != given.npos ? "'" : "";
  return fmt::format("must be {}, not {}{}{}", allowed, quote, printable(given, kMostShown), quote);
}

std::string read(const Setting& s, const Json& from, Defines& out) {
  if (!from.is_object() || from.size() > kMaxDefines)
    return must_be(allowed<Defines>(s, Form::json), from.is_object() ? "more of them" : from.type_name());
  for (const auto& [name, value] : from.items()) {
    const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    if (value.is_structured() || value.is_null())
      return fmt::format("gives '{}' {}: a value is a text, number or boolean",
                         printable(name, kMaxNameBytes), value.is_null() ? "null" : "a list or object");
    if (!is_entry(name, text))
      return must_be(allowed<Defines>(s, Form::json),
                     fmt::format("'{}': {}", name.substr(0, kMaxNameBytes), text));
    out.emplace(name, text);
  }
  return {};
}

std::string read(const Setting& s, Form form, std::string_view from, Defines& out) {
  const std::size_t equals = std::min(from.find('='), from.size());
  const std::string name(from.substr(0, equals)), value(from.substr(std::min(equals + 1, from.size())));
  if (equals == from.size()) return fmt::format("'{}' must be NAME=VALUE", printable(from, kMostShown));
  if (!is_entry(name, value) || out.size() == kMaxDefines) return must_be(allowed<Defines>(s, form), from);
  return out.emplace(name, value).second ? ""
                                         : fmt::format("gives '{}' twice", printable(name, kMaxNameBytes));
}

std::string read(const Setting& s, Form form, std::string_view from, std::uint64_t& out) {
  constexpr std::string_view kUnits = "KMGT";
  const std::size_t unit = from.empty() ? kUnits.npos : kUnits.find(from.back());
  const bool scaled = form == Form::option && s.unit == "bytes" && unit != kUnits.npos;
  const std::size_t shift = scaled ? 10 * (unit + 1) : 0;
  const bool fine = parse(from.substr(0, from.size() - scaled), out) && out <= s.range.most >> shift &&
                    fits(s, out << shift);
  out <<= shift;
  return fine ? "" : must_be(allowed<std::uint64_t>(s, form), from);
}

}  // namespace ls::job
