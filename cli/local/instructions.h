// Counts the instructions executed by a thread and the threads it starts, with the processor's counter.
#pragma once

#include <cstdint>

#include "common/base/error.h"

namespace ls::cli {

class InstructionCounter {
 public:
  // unavailable: the machine has no such counter (most virtual machines), or does not allow its use. `opener`
  // returns a descriptor from which counts of eight bytes can be read, or -1 with errno set; tests replace
  // it.
  static Result<InstructionCounter> open(int (*opener)() = &of_this_thread);
  InstructionCounter(InstructionCounter&& other) noexcept;
  InstructionCounter& operator=(InstructionCounter&&) = delete;
  ~InstructionCounter();

  // Instructions in user mode of the thread that opened it and of all threads it has started since. Counts
  // vary slightly from run to run.
  Result<std::uint64_t> read() const;

 private:
  static int of_this_thread();
  explicit InstructionCounter(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace ls::cli
