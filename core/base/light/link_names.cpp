#include "core/base/light/link_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/safe_text.h"

namespace ls {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

std::vector<std::string_view> split(std::string_view text) {
  std::vector<std::string_view> names;
  if (text.find_first_not_of(kBlanks) == std::string_view::npos) return names;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    std::string_view name = text.substr(begin, end - begin);
    name.remove_prefix(std::min(name.find_first_not_of(kBlanks), name.size()));
    name = name.substr(0, name.find_last_not_of(kBlanks) + 1);
    names.push_back(name);
    begin = end + 1;
  }
  return names;
}

// Returns why one of the names is no name of a set, or an empty text.
std::string wrong_name(const std::vector<std::string_view>& names) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  if (names.empty() || names.size() > kMostLinkNames)
    return fmt::format("a list of link sets has 1 to {} names, not {}", kMostLinkNames, names.size());
  for (const std::string_view name : names) {
    const bool right = !name.empty() && name.front() != '-' && name.size() <= kMostLinkNameBytes &&
                       std::ranges::all_of(name, fits);
    if (!right)
      return fmt::format(
          "the name of a link set has 1 to {} ASCII letters, digits, '_' and '-', the first of them not '-'; "
          "names are separated by commas. \"{}\" is no such name",
          kMostLinkNameBytes, plain_text(name.substr(0, kMostLinkNameBytes)));
  }
  return {};
}

std::vector<std::string> sorted(const std::vector<std::string_view>& names) {
  std::vector<std::string> list(names.begin(), names.end());
  std::ranges::sort(list);
  list.erase(std::ranges::unique(list).begin(), list.end());
  return list;
}

// The names of a list without and with a '-' in front, which is left out.
struct Signed {
  std::vector<std::string_view> with, without;
};
Signed by_sign(std::string_view text) {
  Signed list;
  for (const std::string_view name : split(text)) {
    if (name.starts_with('-'))
      list.without.push_back(name.substr(1));
    else
      list.with.push_back(name);
  }
  return list;
}

}  // namespace

bool LinkList::has(const std::vector<std::string>& sets) const {
  const auto any_of = [&](const std::vector<std::string>& names) {
    return std::ranges::any_of(
        sets, [&](const std::string& set) { return std::ranges::binary_search(names, set); });
  };
  return !any_of(without) && (with.empty() || any_of(with));
}

std::string wrong_link_sets(std::string_view text) {
  const auto names = split(text);
  if (std::string wrong = wrong_name(names); !wrong.empty()) return wrong;
  if (std::ranges::find(names, kNoLinkSet) == names.end()) return {};
  return fmt::format(
      "nothing can be in the link set \"{0}\": lights are linked to \"{0}\" if they have no "
      "receivers or no blockers. Choose another name",
      kNoLinkSet);
}

std::string wrong_link_list(std::string_view text) {
  const Signed list = by_sign(text);
  std::vector<std::string_view> all = list.with;
  all.insert(all.end(), list.without.begin(), list.without.end());
  if (std::string wrong = wrong_name(all); !wrong.empty()) return wrong;
  for (const std::string_view name : list.with)
    if (std::ranges::find(list.without, name) != list.without.end())
      return fmt::format("the link set \"{0}\" is both in the list and, as \"-{0}\", taken out of it", name);
  return {};
}

std::vector<std::string> link_sets(std::string_view text) { return sorted(split(text)); }

LinkList link_list(std::string_view text) {
  const Signed list = by_sign(text);
  return {sorted(list.with), sorted(list.without)};
}

}  // namespace ls
