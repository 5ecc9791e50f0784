// Identifiers of objects in AOVs: their slots in a pixel, and names and header strings as in Cryptomatte.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace ls {

inline constexpr int kIdSlots = 8;
// planes per pixel: identifier and count of each slot, and IdSlots::more
inline constexpr std::size_t kIdPlanes = 2 * kIdSlots + 1;

struct IdSlot {
  float id = 0;
  float n = 0;  // number of samples that hit the object: an integer, at most 2^24
  bool operator==(const IdSlot&) const = default;
};
// The identifiers of the objects that are visible in a pixel, with the number of samples that hit each: a
// fixed number of slots (identifier, count), and the number `more` of samples that found no slot. An
// identifier is a float made from a name as in Cryptomatte; it is a normal float, never 0. Slots have one
// canonical order: by count, largest first, then by the bits of the identifier; unused slots are 0, 0.
//
// Adding two IdSlots keeps the slots with the largest counts; the other counts are added to `more`. If the
// samples of a pixel hit at most kIdSlots objects, every count is exact, whatever the order of additions.
// Otherwise a count may be too low by at most `more`.
struct IdSlots {
  std::array<IdSlot, kIdSlots> slots{};
  float more = 0;
  bool operator==(const IdSlots&) const = default;
};

bool is_identifier(float id);

// Makes slots from the objects that one unit found in a pixel. `seen` has each object once, in any order.
IdSlots ranked(std::vector<IdSlot> seen);
IdSlots operator+(const IdSlots& a, const IdSlots& b);

// Checks whether slots are possible for this number of samples. Returns a description of the fault, or an
// empty text if there is none.
std::string wrong_with(const IdSlots& slots, std::uint64_t samples);

// load_slots() reads the slots of one pixel from its kIdPlanes planes, and store_slots() writes them.
// `stride` is the distance between planes in floats.
IdSlots load_slots(const float* planes, std::size_t stride);
void store_slots(const IdSlots& slots, float* planes, std::size_t stride);

// The functions below follow Cryptomatte 1.2.0: J. Friedman, A. Jones, "Fully automatic ID mattes with
// support for motion blur and transparency", SIGGRAPH 2015 posters, and its specification.

// Returns the hash MurmurHash3_x86_32 (A. Appleby, public domain) with seed 0.
std::uint32_t murmur3_32(std::string_view text);

// Returns the identifier of a name: its hash, whose bits are taken as those of a float. If the float were 0,
// denormal, infinite or NaN, one bit of its exponent is flipped, since some programs would change such
// floats.
float cryptomatte_id(std::string_view name);

// Returns a Cryptomatte manifest: {"name":"8 hexadecimal digits of its identifier", ...}, sorted by name,
// without duplicates.
std::string cryptomatte_manifest(std::vector<std::string> names);

// Returns the header strings of the layer named `layer`: cryptomatte/KEY/name, /hash, /conversion and
// /manifest, where KEY is made from the layer's name. The manifest string is omitted if `manifest` is empty.
std::map<std::string, std::string> cryptomatte_header(std::string_view layer, const std::string& manifest);

}  // namespace ls
