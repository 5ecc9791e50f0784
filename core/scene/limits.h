// All limits of scene reading. Each constant is the largest permitted size, count or depth. Scene text is
// untrusted: each limit is checked before memory is allocated. Scene files are in the XML formats of Mitsuba
// or Nori, or in the formats of pbrt or glTF, which are translated to elements of Mitsuba's format.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/image/frame/render_limits.h"

namespace ls::scene {

inline constexpr std::size_t kMaxTextBytes = std::size_t{32} << 20;  // bytes of one scene file
// Bytes of a scene file and all files that it includes
inline constexpr std::size_t kMaxTotalTextBytes = std::size_t{64} << 20;
// Elements of a scene file and all files that it includes; for a pbrt or glTF file, the elements to which it
// is translated are counted
inline constexpr std::size_t kMaxElements = 500'000;
inline constexpr std::size_t kMaxAttributes = 2'000'000;
// Attributes of one XML element; no known element has more than 5
inline constexpr std::size_t kMaxElementAttributes = 32;
inline constexpr int kMaxNesting = 64;
inline constexpr int kMaxIncludeDepth = 15;  // the same as in Mitsuba 3
inline constexpr int kMaxIncludes = 256;
inline constexpr std::size_t kMaxParameters = 4096;  // scene parameters ($name) that <default> and -D define
inline constexpr std::size_t kMaxParameterNameBytes = 128;
// Bytes of an attribute's value after its scene parameters are substituted, and of a word or quoted text in a
// pbrt file
inline constexpr std::size_t kMaxValueBytes = std::size_t{64} << 10;
// Total bytes of all attribute values in which scene parameters were substituted
inline constexpr std::size_t kMaxSubstitutedBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxSearchPaths = 64;     // number of <path> elements
inline constexpr std::size_t kMaxMeterSensors = 1000;  // sensors that are meters, each of one point or many
inline constexpr std::size_t kMaxMeterNameBytes = 128;
// Children of one object of a Nori file
inline constexpr std::size_t kMaxObjectChildren = 4096;
// Parameters of one object of a pbrt file
inline constexpr std::size_t kMaxPbrtParameters = 64;
// Quoted values of one parameter of a pbrt file
inline constexpr std::size_t kMaxPbrtTexts = 256;
inline constexpr std::size_t kMaxPbrtNesting = 256;       // nesting depth of AttributeBegin in a pbrt file
inline constexpr std::size_t kMaxGltfValues = 2'000'000;  // JSON values in a glTF file
inline constexpr std::size_t kMaxGltfNodes = 256;         // nesting depth of nodes in a glTF file
// Total number of elements in those accessors of a glTF file that have no buffer view; these elements are all
// 0
inline constexpr std::size_t kMaxGltfEmptyCount = 1 << 20;
// Numbers that are read from the accessors of a glTF file; the numbers of an accessor count each time it is
// used
inline constexpr std::size_t kMaxGltfNumbers = std::size_t{1} << 28;
// Morph targets of a mesh of a glTF file; also numbers in one keyframe of an animation
inline constexpr std::size_t kMaxGltfTargets = 4096;
// Sets of joints and weights of a primitive of a glTF file; each set has four joints per vertex
inline constexpr std::size_t kMaxGltfJointSets = 8;
// Bytes of all meshes of a glTF file, written as PLY
inline constexpr std::size_t kMaxGltfMeshBytes = std::size_t{1} << 30;
// Nesting depth of objects; an object that is referred to counts as nested in the object with the reference
inline constexpr int kMaxReferenceDepth = 64;
// Nesting depth of bsdfs. A blend has two inner bsdfs, so 8 levels allow up to 2^7 innermost bsdfs.
inline constexpr int kMaxBsdfNesting = 8;
// Nesting depth of phase functions; a blend has two
inline constexpr int kMaxPhaseNesting = 8;
// Angles of a tabulated phase function. So many numbers fit into one attribute, however many digits they
// have.
inline constexpr std::size_t kMaxPhaseAngles = 2520;
inline constexpr std::size_t kMaxMotionKeys = 1000;
inline constexpr double kMaxTime = 1e9;  // of a key and of the shutter, in either direction
// Nesting depth of volumes; a product has two
inline constexpr int kMaxVolumeNesting = 8;
inline constexpr int kMaxNoiseOctaves = 16;
// Points of the curve of a volume "remap"
inline constexpr std::size_t kMaxRampPoints = 64;
inline constexpr double kMaxTemperature = 1e6;  // temperature of a black body, in kelvin
inline constexpr std::size_t kMaxDiagnostics = 20;
inline constexpr std::size_t kMaxExcerptBytes = 160;  // bytes of a source line that a message shows
inline constexpr std::size_t kMaxSceneJsonBytes = std::size_t{256} << 20;
inline constexpr int kMaxJsonNesting = 16;
// Comparisons of pairs of shapes in the search for media that no light enters (analysis/unreachable.cpp).
// Media that are left when the limit is reached count as entered by light.
inline constexpr std::uint64_t kMaxEntrances = std::uint64_t{1} << 23;

}  // namespace ls::scene
