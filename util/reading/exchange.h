// The messages between a program and lightshaft-scene, the process that reads scene files for it. The program
// sends the text of a scene; the process asks for files that the scene names, and at last sends the scene in
// its canonical form. A malicious scene may take the process over: the program takes no size, number or text
// from it unchecked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/scene/diagnostic.h"
#include "core/scene/reading.h"
#include "util/sandbox/channel.h"

namespace ls::reading {

enum class Kind : std::uint8_t {
  // The program's request, which the process answers at once with `begun` and then with `done`: file name,
  // text, the options (to_fields()).
  read,
  done,  // the scene's canonical form (empty: there are errors), then the diagnostics (to_fields())
  // The process's requests, which the program answers with `found`, `contents` or `refused`: a name.
  find,
  text,
  found,     // digest in hexadecimal, size in bytes
  contents,  // the text of a file
  begun,     // the process has the request
  refused,   // number of the Errc, message
};

// Upper limits for the bytes of a message: of any kind, and of the kinds that name a file or a reason.
inline constexpr std::size_t kMaxBytes = std::size_t{1} << 30;
inline constexpr std::size_t kMaxNameBytes = std::size_t{64} << 10;
inline constexpr std::size_t kMaxFields = 4096;
inline constexpr int kOutOfMemory = 3;  // exit status of the process

struct Message {
  Kind kind{};
  std::vector<std::string> fields;
};

// Both block; meanwhile they call `watch` (channel.h). False or nullopt: the other side has closed the
// channel, or has sent what is no message. A message of the kinds `read`, `done` and `contents` may have
// `most` bytes.
bool send(int fd, const Message& message, const Watch& watch = {});
std::optional<Message> receive(int fd, std::size_t most = kMaxBytes, const Watch& watch = {});

// These convert to fields of a message, and back. nullopt: the fields are not of this form.
std::vector<std::string> to_fields(const ReadOptions& options);
std::optional<ReadOptions> to_options(std::vector<std::string> fields);
std::vector<std::string> to_fields(const std::vector<Diagnostic>& diagnostics);
std::optional<std::vector<Diagnostic>> to_diagnostics(std::vector<std::string> fields);
Message refusal(const Error& error);
Error to_error(const Message& refused);

}  // namespace ls::reading
