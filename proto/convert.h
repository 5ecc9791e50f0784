// Converts the messages of farm.proto (the protocol between coordinator and workers) to and from the plain
// values of common/protocol. A value within the limits always becomes a message that reads back equal, except
// for texts that are too long, see below. A received message becomes a value, or an invalid_argument that
// names the wrong field. Code that gets the values need not check a length, a rectangle or a list again.
//
// Names, tags and reasons longer than their limit are cut when sent; ids, tokens and lists are never cut.
#pragma once

#include <string>

#include "common/base/error.h"
#include "common/protocol/limits.h"
#include "common/protocol/messages.h"
#include "proto/farm.pb.h"

namespace ls::wire {

namespace pb = ::lightshaft::farm::v1;

pb::FromWorker to_wire(const FromWorker& message);
pb::ToWorker to_wire(const ToWorker& message);

// True if this version knows this kind of message. A newer peer may send others; the caller should ignore
// them.
bool known(const pb::FromWorker& message);
bool known(const pb::ToWorker& message);

Result<FromWorker> from_wire(const pb::FromWorker& message);
Result<ToWorker> from_wire(const pb::ToWorker& message);

std::string digest_bytes(const Digest& digest);
Result<Digest> digest_from(const std::string& bytes, const char* field);

}  // namespace ls::wire
