#include "tests/unit/numeric_class/libraries.h"

#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <dlfcn.h>

#include <cmath>
#include <cstdio>  // jpeglib.h needs it first
#include <cstring>
#include <limits>

#include <jpeglib.h>

#include "worker/render/geometry/embree.h"

namespace {

bool perturbs(const char* name) { return std::strcmp(ls::test::g_perturbed, name) == 0; }

template <class F>
F* library(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}
template <class T>
T passed_on(const char* name, T v) {
  ++ls::test::g_calls;
  const bool off = perturbs(name) || perturbs(ls::test::kEveryFunction);
  return off ? std::nextafter(v, std::numeric_limits<T>::infinity()) : v;
}

}  // namespace

#define ONE_ARGUMENT(T, name)                      \
  extern "C" T name(T x) noexcept {                \
    static const auto real = library<T(T)>(#name); \
    return passed_on(#name, real(x));              \
  }
#define TWO_ARGUMENTS(T, name)                        \
  extern "C" T name(T x, T y) noexcept {              \
    static const auto real = library<T(T, T)>(#name); \
    return passed_on(#name, real(x, y));              \
  }
#define SINE_AND_COSINE(T, name)                              \
  extern "C" void name(T x, T* s, T* c) noexcept {            \
    static const auto real = library<void(T, T*, T*)>(#name); \
    real(x, s, c);                                            \
    *s = passed_on(#name, *s);                                \
  }

ONE_ARGUMENT(float, acosf)
ONE_ARGUMENT(float, erff)
ONE_ARGUMENT(float, expf)
ONE_ARGUMENT(float, expm1f)
ONE_ARGUMENT(float, log1pf)
ONE_ARGUMENT(float, logf)
ONE_ARGUMENT(float, tanf)
ONE_ARGUMENT(double, acos)
ONE_ARGUMENT(double, cos)
ONE_ARGUMENT(double, erfc)
ONE_ARGUMENT(double, exp)
ONE_ARGUMENT(double, log)
ONE_ARGUMENT(double, sin)
ONE_ARGUMENT(double, tan)
ONE_ARGUMENT(float, cbrtf)
ONE_ARGUMENT(float, exp2f)
ONE_ARGUMENT(double, asin)
ONE_ARGUMENT(double, atan)
ONE_ARGUMENT(double, cbrt)
ONE_ARGUMENT(double, erf)
ONE_ARGUMENT(double, exp2)
ONE_ARGUMENT(double, expm1)
ONE_ARGUMENT(double, lgamma)
ONE_ARGUMENT(double, log10)
ONE_ARGUMENT(double, log1p)
ONE_ARGUMENT(double, log2)
ONE_ARGUMENT(double, tanh)
ONE_ARGUMENT(double, tgamma)
TWO_ARGUMENTS(float, atan2f)
TWO_ARGUMENTS(float, powf)
TWO_ARGUMENTS(double, atan2)
TWO_ARGUMENTS(double, hypot)
TWO_ARGUMENTS(double, pow)
SINE_AND_COSINE(float, sincosf)

extern "C" ssize_t rtcGetDeviceProperty(RTCDevice device, RTCDeviceProperty property) {
  static const auto real = library<ssize_t(RTCDevice, RTCDeviceProperty)>("rtcGetDeviceProperty");
  return real(device, property) + (property == RTC_DEVICE_PROPERTY_VERSION && perturbs("Embree's version"));
}

// One triangle is taken for the one beside it.
static void other_triangle(RTCRayHit* ray) {
  constexpr unsigned kTriangle = 2353;  // of 4608, in the middle of the mesh
  if (perturbs("rtcIntersect1") && ray->hit.primID == kTriangle) --ray->hit.primID;
}
#if LIGHTSHAFT_EMBREE == 3
extern "C" void rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* ray) {
  static const auto real = library<void(RTCScene, RTCIntersectContext*, RTCRayHit*)>("rtcIntersect1");
  real(scene, context, ray);
  other_triangle(ray);
}
#else
extern "C" void rtcIntersect1(RTCScene scene, RTCRayHit* ray, RTCIntersectArguments* arguments) {
  static const auto real = library<void(RTCScene, RTCRayHit*, RTCIntersectArguments*)>("rtcIntersect1");
  real(scene, ray, arguments);
  other_triangle(ray);
}
#endif

extern "C" JDIMENSION jpeg_read_scanlines(j_decompress_ptr info, JSAMPARRAY rows, JDIMENSION count) {
  static const auto real =
      library<JDIMENSION(j_decompress_ptr, JSAMPARRAY, JDIMENSION)>("jpeg_read_scanlines");
  const JDIMENSION read = real(info, rows, count);
  if (perturbs("JPEG")) rows[0][0] ^= 1;
  return read;
}

// Imf::InputPart::readPixels by its name in the library.
#define READ_PIXELS "_ZN7Imf_3_19InputPart10readPixelsEii"
void read_pixels(Imf::InputPart* part, int first, int last) asm(READ_PIXELS);
void read_pixels(Imf::InputPart* part, int first, int last) {
  static const auto real = library<void(Imf::InputPart*, int, int)>(READ_PIXELS);
  real(part, first, last);
  const auto packed = part->header().compression();
  if ((perturbs("DWA") && packed == Imf::DWAA_COMPRESSION) ||
      (perturbs("B44") && packed == Imf::B44_COMPRESSION) ||
      (perturbs("PXR24") && packed == Imf::PXR24_COMPRESSION)) {
    const Imf::Slice& red = part->frameBuffer()["R"];
    red.base[first * static_cast<std::ptrdiff_t>(red.yStride)] ^= 1;
  }
}
