// Converts the messages of farm.proto (the protocol between coordinator and workers) to and from the structs
// of util/protocol/messages.h. A struct whose values are within their limits and whose texts are UTF-8
// survives the round trip unchanged. A received message is converted, or rejected with invalid_argument and
// the name of the invalid field, so the code that uses the structs need not check lengths, rectangles or
// lists again.
//
// Names, tags and reasons longer than their limit are cut when sent; ids, tokens and lists are never cut.
#pragma once

#include <string>

#include "core/base/error.h"
#include "proto/farm.pb.h"
#include "util/protocol/limits.h"
#include "util/protocol/messages.h"

namespace ls::wire {

namespace pb = ::lightshaft::farm::v1;

pb::FromWorker to_wire(const FromWorker& message);
pb::ToWorker to_wire(const ToWorker& message);

// Returns the text in a form that may be sent: bytes that are not UTF-8 are replaced by '?', because a peer
// drops the whole message if one of its strings is not valid UTF-8. The text is cut to at most `limit` bytes,
// between two characters.
std::string sendable(const std::string& text, std::size_t limit);

// True if this version of the program knows messages of this kind. A peer of a newer version may send other
// kinds; the caller should ignore them.
bool known(const pb::FromWorker& message);
bool known(const pb::ToWorker& message);

Result<FromWorker> from_wire(const pb::FromWorker& message);
Result<ToWorker> from_wire(const pb::ToWorker& message);

std::string digest_bytes(const Digest& digest);
Result<Digest> digest_from(const std::string& bytes, const char* field);

}  // namespace ls::wire
