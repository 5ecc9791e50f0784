// All limits of scene reading. Scene text is untrusted: each limit is checked before memory is allocated.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/image/frame/render_limits.h"

namespace ls::scene {

inline constexpr std::size_t kMaxTextBytes = std::size_t{32} << 20;       // one scene file
inline constexpr std::size_t kMaxTotalTextBytes = std::size_t{64} << 20;  // including all included files
inline constexpr std::size_t kMaxElements = 500'000;                      // including all included files
inline constexpr std::size_t kMaxAttributes = 2'000'000;
inline constexpr std::size_t kMaxElementAttributes = 32;  // per element; at most 5 are meaningful
inline constexpr int kMaxNesting = 64;
inline constexpr int kMaxIncludeDepth = 15;  // as Mitsuba 3
inline constexpr int kMaxIncludes = 256;
inline constexpr std::size_t kMaxParameters = 4096;  // <default> and -D together
inline constexpr std::size_t kMaxParameterNameBytes = 128;
inline constexpr std::size_t kMaxValueBytes = std::size_t{64} << 10;  // one attribute after substitution
inline constexpr std::size_t kMaxSubstitutedBytes = std::size_t{64} << 20;  // all attributes together
inline constexpr std::size_t kMaxSearchPaths = 64;                          // <path>
inline constexpr std::size_t kMaxObjectChildren = 4096;                     // per object of a Nori file
inline constexpr int kMaxReferenceDepth = 64;  // objects within objects, including by reference
inline constexpr int kMaxBsdfNesting = 8;      // nesting of bsdfs; nested blends may contain 2^7 of them
inline constexpr std::size_t kMaxDiagnostics = 20;
inline constexpr std::size_t kMaxExcerptBytes = 160;  // longest part of a source line in a message
inline constexpr std::size_t kMaxSceneJsonBytes = std::size_t{256} << 20;
inline constexpr int kMaxJsonNesting = 16;
// The most pairs of shapes that are compared to find out whether one lets light into the other.
inline constexpr std::uint64_t kMaxEntrances = std::uint64_t{1} << 23;

}  // namespace ls::scene
