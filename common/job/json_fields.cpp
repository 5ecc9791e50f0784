#include "common/job/json_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/base/parse_number.h"
#include "common/base/text/suggest.h"
#include "common/job/limits.h"

namespace ls::job {
namespace {

// True if the text is short enough and has only letters, digits and "_-.:", which are safe in the names of
// files, labels and layers.
bool is_name(const std::string& s) {
  return !s.empty() && s.size() <= kMaxNameBytes && std::ranges::all_of(s, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.' || c == ':';
  });
}

constexpr int kMaxNesting = 8;
constexpr std::string_view kNameRule = "a name of up to 64 letters, digits and _-.:";

std::optional<std::pair<std::int64_t, std::int64_t>> parse_wxh(std::string_view text) {
  const std::size_t x = text.find('x');
  if (x == text.npos) return std::nullopt;
  const auto width = parse_number<std::int64_t>(text.substr(0, x)),
             height = parse_number<std::int64_t>(text.substr(x + 1));
  return width && height ? std::optional(std::pair{*width, *height}) : std::nullopt;
}

}  // namespace

std::string printable(std::string_view text, std::size_t most) {
  std::string out(text.substr(0, most));
  for (char& c : out)
    if (c < ' ' || c > '~') c = '?';
  if (text.size() > most) out += "...";
  return out;
}

Result<Json> parse_object(std::string_view text, std::string_view what) {
  if (text.size() > kMaxSpecBytes)
    return bad_argument(fmt::format("{}: {} bytes, the limit is {}", what, text.size(), kMaxSpecBytes));
  std::set<std::pair<int, std::string>> keys;
  std::optional<std::string> twice;
  bool too_deep = false;
  const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
    too_deep |= depth > kMaxNesting;
    // Once the text is too deep, values are discarded. Otherwise destroying or printing them, which is
    // recursive, could overflow the stack.
    if (too_deep) return false;
    if (event == Json::parse_event_t::key && depth <= 2) {
      const auto& key = parsed.get_ref<const std::string&>();
      if (!keys.emplace(depth, key).second && !twice) twice = key;
    } else if (event == Json::parse_event_t::object_end && depth == 1) {
      std::erase_if(keys, [](const auto& k) { return k.first == 2; });
    }
    return true;
  };
  try {
    auto json = Json::parse(text, watch);
    if (too_deep) return bad_argument(fmt::format("{}: nested deeper than {} levels", what, kMaxNesting));
    if (!json.is_object()) return bad_argument(fmt::format("{}: must be a JSON object {{...}}", what));
    if (twice)
      return bad_argument(fmt::format("{}: key '{}' is given twice", what, printable(*twice, kMaxNameBytes)));
    return json;
  } catch (const Json::exception& e) {
    return bad_argument(fmt::format("{}: not valid JSON: {}", what, printable(e.what(), 300)));
  }
}

Fields::Fields(const Json& object, std::string_view what, std::vector<std::string> known)
    : object_(object), what_(what) {
  for (const auto& item : object.items()) {
    if (std::ranges::find(known, item.key()) != known.end()) continue;
    const std::string name = printable(item.key(), kMaxNameBytes);
    wrong(name, "is not known" + suggestion(name, known));
  }
}

void Fields::wrong(std::string_view key, std::string_view problem) {
  if (!error_) error_ = Error{Errc::invalid_argument, fmt::format("{}: '{}' {}", what_, key, problem)};
}

const Json* Fields::find(const char* key) const {
  const auto it = object_.find(key);
  return it == object_.end() ? nullptr : &*it;
}

void Fields::require(const char* key) {
  if (!find(key)) wrong(key, "is missing");
}

std::optional<std::uint64_t> Fields::whole(const char* key, std::uint64_t least, std::uint64_t most) {
  const Json* v = find(key);
  if (!v) return std::nullopt;
  if (v->is_number_unsigned() && v->get<std::uint64_t>() >= least && v->get<std::uint64_t>() <= most)
    return v->get<std::uint64_t>();
  wrong(key,
        fmt::format("must be a whole number from {} to {}, not {}", least, most, printable(v->dump(), 80)));
  return std::nullopt;
}

std::optional<std::int64_t> Fields::integer(const char* key, std::int64_t least, std::int64_t most) {
  const Json* v = find(key);
  if (!v) return std::nullopt;
  // A number above INT64_MAX is rejected here, because get<std::int64_t>() would make it negative.
  const bool fits =
      v->is_number_integer() && !(v->is_number_unsigned() && v->get<std::uint64_t>() > INT64_MAX);
  if (fits && v->get<std::int64_t>() >= least && v->get<std::int64_t>() <= most)
    return v->get<std::int64_t>();
  wrong(key, fmt::format("must be a whole number from {} to {}", least, most));
  return std::nullopt;
}

std::optional<double> Fields::positive(const char* key, double most) {
  const Json* v = find(key);
  if (!v) return std::nullopt;
  if (v->is_number() && v->get<double>() > 0 && v->get<double>() <= most) return v->get<double>();
  wrong(key, fmt::format("must be a number above 0, at most {}", most));
  return std::nullopt;
}

std::optional<bool> Fields::boolean(const char* key) {
  const Json* v = find(key);
  if (!v) return std::nullopt;
  if (v->is_boolean()) return v->get<bool>();
  wrong(key, "must be true or false");
  return std::nullopt;
}

std::optional<std::string> Fields::name(const char* key) {
  const Json* v = find(key);
  if (!v) return std::nullopt;
  if (v->is_string() && is_name(v->get_ref<const std::string&>())) return v->get<std::string>();
  wrong(key, fmt::format("must be {}", kNameRule));
  return std::nullopt;
}

std::optional<std::vector<std::string>> Fields::names(const char* key) {
  const Json* v = find(key);
  if (!v) return std::nullopt;
  bool fine = v->is_array() && v->size() <= kMaxNames;
  std::vector<std::string> out;
  for (std::size_t i = 0; fine && i < v->size(); ++i) {
    fine = (*v)[i].is_string() && is_name((*v)[i].get_ref<const std::string&>());
    if (fine) out.push_back((*v)[i].get<std::string>());
  }
  if (fine) return out;
  wrong(key, fmt::format("must be a list of at most {} strings, each {}", kMaxNames, kNameRule));
  return std::nullopt;
}

std::optional<FrameSize> Fields::size(const char* key) {
  const Json* v = find(key);
  if (!v) return std::nullopt;
  std::optional<std::pair<std::int64_t, std::int64_t>> size;
  if (v->is_string()) {
    size = parse_wxh(v->get_ref<const std::string&>());
  } else if (v->is_array() && v->size() == 2 && (*v)[0].is_number_integer() && (*v)[1].is_number_integer()) {
    size = {(*v)[0].get<std::int64_t>(), (*v)[1].get<std::int64_t>()};
  }
  if (!size) {
    wrong(key, "must be [width, height] or \"WIDTHxHEIGHT\", in pixels");
    return std::nullopt;
  }
  const auto [w, h] = *size;
  if (w < 1 || h < 1 || w > kMaxFrameSide || h > kMaxFrameSide || w * h > kMaxFramePixels) {
    wrong(key, fmt::format("is {} x {}; each side must be 1 to {} pixels, and all together at most {}", w, h,
                           kMaxFrameSide, kMaxFramePixels));
    return std::nullopt;
  }
  return FrameSize{static_cast<int>(w), static_cast<int>(h)};
}

}  // namespace ls::job
