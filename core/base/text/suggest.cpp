#include "core/base/text/suggest.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <vector>

namespace ls {
namespace {

constexpr std::size_t kMaxName = 64;    // longer names are not compared, since the cost is quadratic
constexpr std::size_t kMaxListed = 24;  // a longer list of names would make a message unreadable

std::string folded(std::string_view name) {
  std::string out;
  for (const char c : name)
    if (c != '_' && c != '-') out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

// Returns the optimal string alignment distance: the smallest number of insertions, deletions, substitutions
// and swaps of neighbouring letters that change one text into the other.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

}  // namespace

std::optional<std::string> nearest_name(std::string_view given, std::span<const std::string> known) {
  if (given.empty() || given.size() > kMaxName) return std::nullopt;
  const std::string name = folded(given);
  std::optional<std::string> best;
  std::size_t best_distance = 0, work = 0;
  for (const std::string& candidate : known) {
    if (candidate.size() > kMaxName) continue;
    const std::string other = folded(candidate);
    const std::size_t shorter = std::min(name.size(), other.size()),
                      longer = std::max(name.size(), other.size());
    // the distance is at least the difference of the lengths, so this name is too far away
    if ((longer - shorter) * 3 > longer) continue;
    if (work += shorter * longer; work > kMaxNameWork) break;
    const std::size_t d = distance(name, other);
    if (d * 3 > longer || (best && d >= best_distance)) continue;
    best = candidate;
    best_distance = d;
  }
  return best;
}

std::string suggestion(std::string_view given, std::span<const std::string> known) {
  if (const auto name = nearest_name(given, known)) return fmt::format("; did you mean '{}'?", *name);
  return listing(known);
}

std::string listing(std::span<const std::string> known) {
  if (known.empty() || known.size() > kMaxListed) return {};
  return fmt::format("; known here: {}", fmt::join(known, ", "));
}

}  // namespace ls
