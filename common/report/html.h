// Markup out of text that strangers wrote, and whole pages that need nothing but themselves.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace ls::report {

// For the text of an element and for a quoted attribute's value, of HTML and of SVG. What could forge lines
// or turn letters round (common/base/plain_text.h) becomes a space; line ends stay.
std::string escape_html(std::string_view text);

std::string base64(std::span<const std::byte> bytes);  // RFC 4648, with padding
std::string data_url(std::string_view media_type, std::span<const std::byte> bytes);

// A whole document: no scripts, no address outside of it, and a policy of its own that forbids both: styles
// only as given here (by digest), pictures only as data. `title` is text, `css` and `body` are markup of
// ours.
std::string document(std::string_view title, std::string_view css, std::string_view body);
// The same policy, for the header of a response.
std::string document_policy(std::string_view css);

}  // namespace ls::report
