// Formats numbers for users.
#pragma once

#include <cstdint>
#include <string>

namespace ls::report {

inline constexpr const char* kAbsent = "–";  // shown for unknown (non-finite) values

std::string superscript(int n);  // returns "⁻⁴" for -4
// Returns three significant digits: "0.0213", "3.20 × 10⁻⁵".
std::string figure(double x);
// Returns the text for an error against a reference: figure(x) or, if `below_noise`, "below the reference's
// noise".
std::string true_figure(double x, bool below_noise);
std::string given(double x);  // returns a number that a user has chosen, with its original digits: "0.001"
// Returns "0.4 s", "12 s", "4.2 min", "1 h 12 min", "3 d 4 h".
std::string duration(double seconds);
std::string count(double n);           // returns "39,321,600"
std::string sample_count(double spp);  // returns "1,024"; a mean below 100 has one decimal: "5.7"
// Returns "4"; a number that is not whole (a mean) has one decimal: "3.5".
std::string threads_words(double n);
std::string byte_size(double n);  // returns "34.7 MiB"
// Returns "12 %" or "< 1 %" in plain text; `part` is a fraction from 0 to 1. "0 %" is returned only for
// exactly 0, and "100 %" only for 1.
std::string percent(double part);
std::string date_time(double unix_seconds);  // returns "2026-11-21 18:26 UTC"

}  // namespace ls::report
