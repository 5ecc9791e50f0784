// Generates markup from untrusted text, and self-contained pages.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace ls::report {

// Escapes `text` for use as the text of an element or as a quoted attribute value, in HTML and SVG.
// Characters that could forge lines or reorder letters (core/base/safe_text.h) become spaces; line ends are
// kept.
std::string escape_html(std::string_view text);

std::string base64(std::span<const std::byte> bytes);  // encodes as RFC 4648, with padding
std::string data_url(std::string_view media_type, std::span<const std::byte> bytes);

// Returns a whole HTML document. It has no scripts and no external addresses, and its content security policy
// forbids both. The policy permits only the style sheet `css` (identified by its digest) and images in data
// URLs. `title` is plain text, which is escaped here; `css` and `body` are trusted and inserted unchanged.
std::string document(std::string_view title, std::string_view css, std::string_view body);
// Returns the content security policy of document(), for the header of an HTTP response.
std::string document_policy(std::string_view css);

}  // namespace ls::report
