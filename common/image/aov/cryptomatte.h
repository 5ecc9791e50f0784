// Cryptomatte 1.2.0 (J. Friedman, A. Jones, "Fully automatic ID mattes with support for motion blur and
// transparency", SIGGRAPH 2015 posters, and its specification): identifiers from names, and the header
// strings of a layer.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace ls {

// Returns the hash MurmurHash3_x86_32 (A. Appleby, public domain) with seed 0.
std::uint32_t murmur3_32(std::string_view text);

// Returns the identifier of a name: its hash, whose bits are taken as a float. If this float were 0,
// denormal, infinite or NaN, one exponent bit is flipped, since some programs would change such floats.
float cryptomatte_id(std::string_view name);

// Returns {"name":"8 hexadecimal digits of its id", ...}, sorted by name, without duplicates.
std::string cryptomatte_manifest(std::vector<std::string> names);

// Returns the header strings of layer `layer`: cryptomatte/KEY/name, hash, conversion and manifest (omitted
// if empty).
std::map<std::string, std::string> cryptomatte_header(std::string_view layer, const std::string& manifest);

}  // namespace ls
