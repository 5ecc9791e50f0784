// The numeric class must tell machines apart whose libraries differ in one last place. This executable
// defines the mathematical functions that the renderer calls (`nm` of its libraries lists them) and Embree's
// version query: each passes on the library's answer, or the next number beside it. The class is computed
// once a process, so every answer comes from a child.
#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "worker/render/render.h"

namespace {

const char* g_perturbed = "";
bool perturbs(const char* name) { return std::strcmp(g_perturbed, name) == 0; }

template <class F>
F* library(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}
template <class T>
T passed_on(const char* name, T v) {
  return perturbs(name) ? std::nextafter(v, std::numeric_limits<T>::infinity()) : v;
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

namespace ls::render {
namespace {

// The class of a machine on which this function is off by one unit in its last place.
std::string class_of_machine(const char* perturbed) {
  int ends[2];
  if (pipe(ends) != 0) return "no pipe";
  const pid_t child = fork();
  if (child == 0) {
    g_perturbed = perturbed;
    const std::string hex = numeric_class().hex();
    const bool written = write(ends[1], hex.data(), hex.size()) == static_cast<ssize_t>(hex.size());
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  std::string hex(64, ' ');
  const bool complete = read(ends[0], hex.data(), hex.size()) == static_cast<ssize_t>(hex.size());
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  return complete && status == 0 ? hex : "the child died";
}

TEST(NumericClass, DiffersWhereAnyFunctionThatTheRendererCallsDoes) {
  const std::string here = class_of_machine("");
  ASSERT_EQ(here.size(), 64u) << here;
  ASSERT_EQ(class_of_machine(""), here);
  for (const char* name : {"acosf",  "erff", "expf",  "expm1f", "log1pf", "logf",    "tanf",
                           "acos",   "cos",  "erfc",  "exp",    "log",    "sin",     "tan",
                           "atan2f", "powf", "atan2", "hypot",  "pow",    "sincosf", "Embree's version"}) {
    const std::string there = class_of_machine(name);
    EXPECT_EQ(there.size(), 64u) << name << ": " << there;
    EXPECT_NE(there, here) << name;
  }
}

}  // namespace
}  // namespace ls::render
