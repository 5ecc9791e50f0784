// Wrappers for instructions that differ between the supported processors, x86-64 and 64-bit ARM.
#pragma once

#ifdef __x86_64__
#include <immintrin.h>
#else
#include <arm_neon.h>
#endif

#include <cstdint>

namespace ls::render {

// Treats denormals as zero in this thread while the object lives, as Embree requires of threads that trace
// rays. The destructor restores the previous mode, since adding pixel sums to the film (the sums of the whole
// image) needs denormals.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(read()) { write(saved_ | kFlush); }
  ~FlushDenormals() { write(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

  // read() and write() access the thread's floating-point control word. kFlush has the bits that are set
  // while the object lives.
#ifdef __x86_64__
  static constexpr std::uint64_t kFlush = 0x8040;
  static std::uint64_t read() { return _mm_getcsr(); }
  static void write(std::uint64_t control) { _mm_setcsr(static_cast<unsigned>(control)); }
#else
  static constexpr std::uint64_t kFlush = std::uint64_t{1} << 24;
  static std::uint64_t read() { return __builtin_aarch64_get_fpcr64(); }
  static void write(std::uint64_t control) { __builtin_aarch64_set_fpcr64(control); }
#endif

 private:
  std::uint64_t saved_;
};

// The processor's approximate 1 / x and 1 / sqrt(x), which Embree uses. Processors of different manufacturers
// return different results.
#ifdef __x86_64__
inline float reciprocal_estimate(float x) { return _mm_cvtss_f32(_mm_rcp_ss(_mm_set_ss(x))); }
inline float reciprocal_root_estimate(float x) { return _mm_cvtss_f32(_mm_rsqrt_ss(_mm_set_ss(x))); }
#else
inline float reciprocal_estimate(float x) { return vrecpes_f32(x); }
inline float reciprocal_root_estimate(float x) { return vrsqrtes_f32(x); }
#endif

}  // namespace ls::render
