// Generates markup from untrusted text, and self-contained pages.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace ls::report {

// For the text of an element and for quoted attribute values, in HTML and SVG. Characters that could forge
// lines or reorder letters (common/base/plain_text.h) become spaces; line ends are kept.
std::string escape_html(std::string_view text);

std::string base64(std::span<const std::byte> bytes);  // RFC 4648, with padding
std::string data_url(std::string_view media_type, std::span<const std::byte> bytes);

// A whole document: no scripts, no external addresses, and a content security policy that forbids both: only
// the styles given here (by digest), images only as data URLs. `title` is text; `css` and `body` are trusted
// markup.
std::string document(std::string_view title, std::string_view css, std::string_view body);
// The same policy, for the header of a response.
std::string document_policy(std::string_view css);

}  // namespace ls::report
