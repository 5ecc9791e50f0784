// Reads, checks and writes objects whose members describe() lists (setting.h): a job's spec, the settings of
// a rendering, a change of a job.
#pragma once

#include "core/base/error.h"
#include "core/base/text/suggest.h"
#include "core/job/limits.h"
#include "core/job/values.h"

namespace ls::job {

// Chooses settings; null chooses all.
using Chosen = bool (*)(const Setting&);
inline bool is_chosen(Chosen chosen, const Setting& s) { return !chosen || chosen(s); }
inline bool goes_with_again(const Setting& s) { return s.again; }
// Returns the row with the sentences for a request to submit a job again.
inline Setting described_for_again(Setting s) {
  if (s.again_doc.empty()) return s;
  s.doc = s.again_doc;
  s.more = {};
  return s;
}

template <class F>
struct Visitor {
  F f;
  template <class T>
  void setting(const Setting& s, T& value) {
    f(s, value);
  }
};
// Calls f(setting, member) for each setting of the object.
template <class T, class F>
void for_each_setting(T& object, F f) {
  Visitor<F> visitor{std::move(f)};
  describe(visitor, object);
}

template <class T>
std::vector<std::string> names_of(Chosen chosen = nullptr) {
  std::vector<std::string> names;
  const T object;
  for_each_setting(object, [&](const Setting& s, const auto&) {
    if (is_chosen(chosen, s)) names.emplace_back(s.name);
  });
  return names;
}

// Returns how a message calls the setting: "spec: 'spp'", "query parameter 'spp'" or "--spp". `what` is the
// name of the JSON object.
inline std::string called(const Setting& s, Form form, std::string_view what) {
  if (form == Form::option) return s.option.empty() ? fmt::format("the {}", s.name) : std::string(s.option);
  return form == Form::query ? fmt::format("query parameter '{}'", s.query_name())
                             : fmt::format("{}: '{}'", what, s.name);
}

inline Result<void> good_or(const std::string& problem, const Setting& s, Form form, std::string_view what) {
  if (problem.empty()) return {};
  return bad_argument(called(s, form, what) + " " + problem);
}

// Returns an error if the object has a key that is not the name of a chosen setting.
template <class T, IsJson J>
Result<void> check_keys(const J& object, std::string_view what, Chosen chosen = nullptr) {
  if (!object.is_object()) return bad_argument(fmt::format("{}: must be a JSON object {{...}}", what));
  const std::vector<std::string> known = names_of<T>(chosen);
  for (const auto& item : object.items()) {
    if (std::ranges::find(known, item.key()) != known.end()) continue;
    const std::string name = printable(item.key(), kMaxNameBytes);
    const std::vector<std::string> all = names_of<T>();
    if (std::ranges::find(all, item.key()) != all.end())
      return bad_argument(fmt::format("{}: '{}' cannot be set here", what, name));
    return bad_argument(fmt::format("{}: '{}' is not known{}", what, name, suggestion(name, known)));
  }
  return {};
}

// Reads the chosen settings that the JSON object has. Unknown keys, wrong types and values out of range are
// errors that name the key.
template <class T, IsJson J>
Result<T> read_object(const J& object, std::string_view what, Chosen chosen = nullptr) {
  Result<void> done = check_keys<T>(object, what, chosen);
  T out;
  for_each_setting(out, [&](const Setting& s, auto& value) {
    const auto found = object.find(s.name);
    if (done && found != object.end()) done = good_or(read(s, *found, value), s, Form::json, what);
  });
  if (!done) return tl::unexpected(done.error());
  return out;
}

// Calls f with the value, if there is one.
template <class T, class F>
void with_value(const T& value, F f) {
  if constexpr (requires { value.has_value(); }) {
    if (value) with_value(*value, f);
  } else {
    f(value);
  }
}

// Returns the text of a value for a message.
template <class T>
std::string shown(const T& value) {
  if constexpr (kIs<T, Defines, PixelRect>)
    return "this";
  else
    return text_of(value);
}

// Checks that the values fit the ranges of their settings, wherever the values come from.
template <class T>
Result<void> check_ranges(const T& object, std::string_view what) {
  Result<void> done;
  for_each_setting(object, [&](const Setting& s, const auto& value) {
    with_value(value, [&]<class M>(const M& present) {
      if (done && !fits(s, present))
        done = good_or(must_be(allowed<M>(s, Form::json), shown(present)), s, Form::json, what);
    });
  });
  return done;
}

// Returns the JSON of the chosen settings: those that canonical JSON always has, and those that differ from
// their default.
template <class T, IsJson J = Json>
J write_object(const T& object, Chosen chosen = nullptr) {
  J out = J::object();
  for_each_setting(object, [&]<class M>(const Setting& s, const M& value) {
    if (!is_chosen(chosen, s) || (value == M{} && !s.always)) return;
    with_value(value, [&](const auto& one) { out[std::string(s.name)] = write(one); });
  });
  return out;
}

}  // namespace ls::job
