// farm.proto to and from the plain values of common/protocol. Total in both directions: a value within the
// limits always becomes a message that reads back equal (texts too long are cut, see below); a received
// message becomes a value or an invalid_argument that names the field. Nothing behind this door needs to
// distrust a length, a rectangle or a list again.
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

// False for a kind of message that a newer peer may send and this version passes over.
bool known(const pb::FromWorker& message);
bool known(const pb::ToWorker& message);

Result<FromWorker> from_wire(const pb::FromWorker& message);
Result<ToWorker> from_wire(const pb::ToWorker& message);

std::string digest_bytes(const Digest& digest);
Result<Digest> digest_from(const std::string& bytes, const char* field);

}  // namespace ls::wire
