// All limits of scene reading. Scene text is untrusted: each limit is checked before memory is allocated.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/image/frame/render_limits.h"

namespace ls::scene {

inline constexpr std::size_t kMaxTextBytes = std::size_t{32} << 20;  // bytes of one scene file
// Bytes of a scene file and all files that it includes
inline constexpr std::size_t kMaxTotalTextBytes = std::size_t{64} << 20;
// Elements of a scene file and all files that it includes
inline constexpr std::size_t kMaxElements = 500'000;
inline constexpr std::size_t kMaxAttributes = 2'000'000;
// Attributes of one element; at most 5 are meaningful
inline constexpr std::size_t kMaxElementAttributes = 32;
inline constexpr int kMaxNesting = 64;
inline constexpr int kMaxIncludeDepth = 15;  // the same as in Mitsuba 3
inline constexpr int kMaxIncludes = 256;
inline constexpr std::size_t kMaxParameters = 4096;  // parameters by <default> and -D together
inline constexpr std::size_t kMaxParameterNameBytes = 128;
// Bytes of one attribute after substitution
inline constexpr std::size_t kMaxValueBytes = std::size_t{64} << 10;
// Bytes of all attributes together
inline constexpr std::size_t kMaxSubstitutedBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxSearchPaths = 64;  // number of <path> elements
// Children of one object of a Nori file
inline constexpr std::size_t kMaxObjectChildren = 4096;
// Parameters of one object of a pbrt file
inline constexpr std::size_t kMaxPbrtParameters = 64;
// Quoted values of one parameter of a pbrt file
inline constexpr std::size_t kMaxPbrtTexts = 256;
inline constexpr std::size_t kMaxPbrtNesting = 256;       // depth of AttributeBegin in a pbrt file
inline constexpr std::size_t kMaxGltfValues = 2'000'000;  // values of the JSON of a glTF file
inline constexpr std::size_t kMaxGltfNodes = 256;         // depth of nodes in a glTF file
// Elements of all accessors of a glTF file that have no buffer view, and so are all 0
inline constexpr std::size_t kMaxGltfEmptyCount = 1 << 20;
// Numbers that are read from a glTF file; those of an accessor count each time it is used
inline constexpr std::size_t kMaxGltfNumbers = std::size_t{1} << 28;
// Morph targets of a mesh of a glTF file, and numbers of one keyframe of its animations
inline constexpr std::size_t kMaxGltfTargets = 4096;
// Sets of joints and weights of a primitive of a glTF file; each set has four joints per vertex
inline constexpr std::size_t kMaxGltfJointSets = 8;
// Bytes of all meshes of a glTF file, written as PLY
inline constexpr std::size_t kMaxGltfMeshBytes = std::size_t{1} << 30;
// Depth of objects within objects, including by reference
inline constexpr int kMaxReferenceDepth = 64;
// Depth of nested bsdfs; a blend of this depth may contain 2^7 bsdfs
inline constexpr int kMaxBsdfNesting = 8;
inline constexpr double kMaxTemperature = 1e6;  // kelvin of a black body
inline constexpr std::size_t kMaxDiagnostics = 20;
inline constexpr std::size_t kMaxExcerptBytes = 160;  // bytes of a source line that a message shows
inline constexpr std::size_t kMaxSceneJsonBytes = std::size_t{256} << 20;
inline constexpr int kMaxJsonNesting = 16;
// Largest number of pairs of shapes that are compared in the search for media that no light enters
// (analysis/unreachable.cpp).
inline constexpr std::uint64_t kMaxEntrances = std::uint64_t{1} << 23;

}  // namespace ls::scene
