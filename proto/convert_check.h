// The checks that received messages go through, each naming the field that is wrong.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/error.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"
#include "proto/convert.h"

namespace ls::wire {

tl::unexpected<Error> wrong(const std::string& field, const std::string& what);

// 1 to kIdBytes printable ASCII characters without spaces.
Result<std::string> id_from(const std::string& text, const char* field);
// At most `limit` bytes; control characters become spaces, so that no log line or terminal is at a worker's
// mercy.
Result<std::string> text_from(const std::string& text, std::size_t limit, const char* field);
// Finite and not negative.
Result<double> seconds_from(double value, const char* field);
// Non-empty, inside the largest frame, its partial within one message.
Result<PixelRect> rect_from(const pb::Rect& rect, const char* field);
// Even ends, not empty, within the largest index.
Result<SampleRange> range_from(std::uint64_t s0, std::uint64_t s1, const char* field);

// A text as it may be sent: valid UTF-8 (a peer throws away a whole message with a string that is not; stray
// bytes become
// '?'), cut to at most `limit` bytes at the end of a character.
std::string sendable(const std::string& text, std::size_t limit);

}  // namespace ls::wire
