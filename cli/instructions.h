// How many instructions this thread has executed, by the processor's own counter.
#pragma once

#include <cstdint>

#include "common/base/error.h"

namespace ls::cli {

class InstructionCounter {
 public:
  // unavailable: the machine has no such counter (most virtual machines), or keeps it from its users.
  static Result<InstructionCounter> open();
  InstructionCounter(InstructionCounter&& other) noexcept;
  InstructionCounter& operator=(InstructionCounter&&) = delete;
  ~InstructionCounter();

  // In user mode, of the thread that opened it, since then. They differ by a few from run to run.
  Result<std::uint64_t> read() const;

 private:
  explicit InstructionCounter(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace ls::cli
