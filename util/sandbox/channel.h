// Bytes through a socket pair, between a program and a process in a sandbox.
#pragma once

#include <cstddef>
#include <functional>

namespace ls {

// Block until all bytes are sent or received; false: the other side has closed the channel. Meanwhile they
// call `watch`, if given: after each part of the bytes, and about every 50 ms while they wait.
using Watch = std::function<void()>;
bool send_all(int fd, const void* data, std::size_t bytes, const Watch& watch = {});
bool receive_all(int fd, void* data, std::size_t bytes, const Watch& watch = {});

}  // namespace ls
