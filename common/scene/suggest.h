// "did you mean": the known name nearest to a misspelt one.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ls::scene {

// The nearest of `known` by edit distance (a swap of neighbours counts once, case and '_' are free), if it is
// near enough to be a slip of the pen: at most a third of the longer name. Of a great many names only as many
// are compared as kMaxNameWork allows.
std::optional<std::string> nearest_name(std::string_view given, std::span<const std::string> known);

// "; known here: a, b, c"; empty if there are none, or more than a message can hold.
std::string listing(std::span<const std::string> known);

// "; did you mean 'x'?" or, with few alternatives and none near, "; known: a, b, c"; possibly empty.
std::string suggestion(std::string_view given, std::span<const std::string> known);

}  // namespace ls::scene
