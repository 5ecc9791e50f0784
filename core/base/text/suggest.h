// "did you mean": finds the known name nearest to a misspelt one.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ls {

// Limit of the work for one suggestion: the total number of cells of the edit-distance tables that are
// filled.
inline constexpr std::size_t kMaxNameWork = 4'000'000;

// Returns the name in `known` that is nearest to `given` by edit distance; a swap of neighbouring letters
// counts as one edit; case, '_' and '-' are ignored. nullopt: even the nearest name differs by more than a
// third of the letters of the longer of the two. If `known` is very long, only its first names are compared,
// as far as kMaxNameWork allows.
std::optional<std::string> nearest_name(std::string_view given, std::span<const std::string> known);

// Returns "; known here: a, b, c". Empty if there are no names, or too many for a message.
std::string listing(std::span<const std::string> known);

// Returns "; did you mean 'x'?", or listing(known) if no name is near.
std::string suggestion(std::string_view given, std::span<const std::string> known);

}  // namespace ls
