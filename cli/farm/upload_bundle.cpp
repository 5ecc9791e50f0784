#include "cli/farm/upload_bundle.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <string_view>

namespace ls::cli {
namespace {

std::string escaped(std::string_view text) {
  std::string out;
  for (const unsigned char c : text)
    out += std::isalnum(c) || c == '-' || c == '_' || c == '.' ? std::string(1, static_cast<char>(c))
                                                               : fmt::format("%{:02X}", c);
  return out;
}

class Query {
 public:
  void add(std::string_view key, std::string_view value) {
    text_ += fmt::format("{}{}={}", text_.empty() ? "?" : "&", key, escaped(value));
  }
  template <class T>
  void add(std::string_view key, const std::optional<T>& value) {
    if (value) add(key, fmt::format("{}", *value));
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

}  // namespace

std::optional<std::string> bundle_type(const std::string& file) {
  std::string name = file;
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  if (name.ends_with(".zip")) return "application/zip";
  for (const char* end : {".tar", ".tar.gz", ".tgz"})
    if (name.ends_with(end)) return "application/x-tar";
  return std::nullopt;
}

std::string spec_query(const JobSpec& spec, bool with_priority) {
  Query query;
  query.add("spp", spec.spp);
  query.add("target_error", spec.target_error);
  query.add("time", spec.time);
  query.add("seed", spec.seed);
  if (spec.size) query.add("size", fmt::format("{}x{}", spec.size->width, spec.size->height));
  query.add("integrator", spec.integrator);
  if (!spec.aov.empty()) query.add("aov", fmt::format("{}", fmt::join(spec.aov, ",")));
  for (const auto& [name, value] : spec.defines) query.add("define", name + "=" + value);
  if (with_priority) query.add("priority", fmt::format("{}", spec.priority));
  if (spec.float_output) query.add("float", "true");
  if (spec.denoise) query.add("denoise", "true");
  if (!spec.tags.empty()) query.add("tags", fmt::format("{}", fmt::join(spec.tags, ",")));
  if (spec.frames) query.add("frames", to_string(*spec.frames));
  query.add("max_workers", spec.max_workers);
  query.add("max_units", spec.max_units);
  query.add("memory", spec.memory);
  if (spec.reference) query.add("reference", spec.reference->hex());
  return query.take();
}

}  // namespace ls::cli
