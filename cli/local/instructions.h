// Counts the instructions executed by a thread and the threads it starts, with the processor's counter.
#pragma once

#include <cstdint>

#include "common/base/error.h"

namespace ls::cli {

class InstructionCounter {
 public:
  // Opens the counter for the calling thread. unavailable: the machine has no such counter (most virtual
  // machines), or does not allow its use. `opener` returns a descriptor from which counts of eight bytes can
  // be read, or -1 with errno set; tests pass their own.
  static Result<InstructionCounter> open(int (*opener)() = &of_this_thread);
  InstructionCounter(InstructionCounter&& other) noexcept;
  InstructionCounter& operator=(InstructionCounter&&) = delete;
  ~InstructionCounter();

  // Returns the number of instructions executed in user mode by the thread that opened the counter and all
  // threads that it has started since. The number varies slightly from run to run.
  Result<std::uint64_t> read() const;

 private:
  static int of_this_thread();
  explicit InstructionCounter(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace ls::cli
