// Treats denormals as zero while rays are traced, as Embree requires.
#pragma once

#include <immintrin.h>

namespace ls::render {

// Sets the thread to treat denormals as zero while the object lives. Afterwards denormals work again, since
// folding (adding up results) needs them.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040); }
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned saved_;
};

}  // namespace ls::render
