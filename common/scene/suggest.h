// "did you mean": the known name nearest to a misspelt one.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ls::scene {

// The nearest of `known` by edit distance (a swap of neighbours counts once, case and '_' are free), if it is
// near enough to be a slip of the pen: at most a third of the longer name.
std::optional<std::string> nearest_name(std::string_view given, std::span<const std::string> known);

// "; did you mean 'x'?" or, with few alternatives and none near, "; known: a, b, c"; possibly empty.
std::string suggestion(std::string_view given, std::span<const std::string> known);

}  // namespace ls::scene
