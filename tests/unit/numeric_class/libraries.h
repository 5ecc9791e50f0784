// The executable's own definitions of the mathematical functions, of Embree's version query and of what hands
// out decoded pixels: each passes on the library's answer, or the next number beside it.
#pragma once

#include <cstdint>
#include <string>

namespace ls::test {

// Whose answers are off by one unit in the last place; "every mathematical function": all of those.
inline const char* g_perturbed = "";
inline constexpr const char* kEveryFunction = "every mathematical function";
// How often a mathematical function was called. Square roots and what only takes a number apart (frexp,
// ldexp, ceil, floor) are exact everywhere and are left to the library.
inline std::uint64_t g_calls = 0;

}  // namespace ls::test
