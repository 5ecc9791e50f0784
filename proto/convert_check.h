// The checks of received messages. Each returns an error that names `field` if the value is wrong.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/error.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"
#include "proto/convert.h"

namespace ls::wire {

tl::unexpected<Error> wrong(const std::string& field, const std::string& what);

// Returns the id, which must be 1 to kIdBytes printable ASCII characters without spaces.
Result<std::string> id_from(const std::string& text, const char* field);
// Returns the text, which must have at most `limit` bytes. Control characters are replaced by spaces, so that
// a worker cannot forge log lines or control a terminal.
Result<std::string> text_from(const std::string& text, std::size_t limit, const char* field);
// Returns the number of seconds, which must be finite and not negative.
Result<double> seconds_from(double value, const char* field);
// Returns the rectangle, which must not be empty and must lie inside the largest frame. It must be so small
// that its partial (the pixel sums of one unit) fits into one message.
Result<PixelRect> rect_from(const pb::Rect& rect, const char* field);
// Returns the range of samples from s0 to s1, which must not be empty or exceed the largest index; s0 and s1
// must be even.
Result<SampleRange> range_from(std::uint64_t s0, std::uint64_t s1, const char* field);

// Returns the text in a form that may be sent: bytes that are not UTF-8 are replaced by '?', because a peer
// drops the whole message if one of its strings is not valid UTF-8. The text is cut to at most `limit` bytes,
// between two characters.
std::string sendable(const std::string& text, std::size_t limit);

}  // namespace ls::wire
