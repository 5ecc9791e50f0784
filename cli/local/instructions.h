// Counts, with the processor's counter, the instructions that a thread and the threads that it starts
// execute. The counts measure the cost of the integrator's variants. A variant is compiled for a subset of
// the features that a scene can have.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"

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

// The result of rendering a small image with one variant. All variants that have the scene's features render
// the same image, so that their bits and their costs can be compared.
struct VariantBits {
  std::string name;
  Digest sums;
  std::optional<double> instructions;  // instructions per path; nullopt if they cannot be counted
};
// The results for all variants that have the scene's features, cheapest first; renders use the first one.
struct VariantBitsList {
  std::vector<VariantBits> all;  // empty: the measurement was not requested
  std::string uncounted;         // why instructions are missing; empty: all were counted
};

// Measures the variants called `names`. `render` renders `paths` paths with the variant of the given name and
// returns the digest of the pixel sums. `counter` counts the instructions of this thread, or is the reason
// why they cannot be counted. If counting fails for one variant, only its number is missing, and the reason
// is given.
VariantBitsList measure_variants(const std::vector<std::string>& names, double paths,
                                 const Result<InstructionCounter>& counter,
                                 const std::function<Digest(const std::string&)>& render);

}  // namespace ls::cli
