// "did you mean": finds the known name nearest to a misspelt one.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ls {

inline constexpr std::size_t kMaxNameWork = 4'000'000;  // cells of edit distance tables for one suggestion

// The nearest of `known` by edit distance (a swap of neighbours counts once; case and '_' are ignored);
// nullopt if it differs by more than a third of the longer name. If there are very many names, only as many
// are compared as kMaxNameWork allows.
std::optional<std::string> nearest_name(std::string_view given, std::span<const std::string> known);

// "; known here: a, b, c"; empty if there are none, or too many for a message.
std::string listing(std::span<const std::string> known);

// "; did you mean 'x'?" or, if none is near and alternatives are few, "; known: a, b, c"; may be empty.
std::string suggestion(std::string_view given, std::span<const std::string> known);

}  // namespace ls
