// How many instructions a thread and those it starts have executed, by the processor's own counter.
#pragma once

#include <cstdint>

#include "common/base/error.h"

namespace ls::cli {

class InstructionCounter {
 public:
  // unavailable: the machine has no such counter (most virtual machines), or keeps it from its users.
  // `opener` gives a descriptor to read counts of eight bytes from, or -1 with errno set: the system's, or a
  // test's.
  static Result<InstructionCounter> open(int (*opener)() = &of_this_thread);
  InstructionCounter(InstructionCounter&& other) noexcept;
  InstructionCounter& operator=(InstructionCounter&&) = delete;
  ~InstructionCounter();

  // In user mode, of the thread that opened it and of all that it has started since. They differ by a few
  // from run to run.
  Result<std::uint64_t> read() const;

 private:
  static int of_this_thread();
  explicit InstructionCounter(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace ls::cli
