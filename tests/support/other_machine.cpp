// Preloaded into a program, this makes it behave as on another machine. LIGHTSHAFT_TEST_ISA names the
// instruction set for which Embree is configured, instead of the one that the program names.
// LIGHTSHAFT_TEST_OFF names a function that gives wrong results: with "rtcIntersect1" one triangle is
// replaced by its neighbour.
#include <dlfcn.h>

#include <cstdlib>
#include <string>
#include <string_view>

namespace {

template <class F>
F* library(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}
std::string_view setting(const char* name) {
  const char* text = std::getenv(name);
  return text ? text : "";
}

}  // namespace

extern "C" void* rtcNewDevice(const char* config) {
  static const auto real = library<void*(const char*)>("rtcNewDevice");
  const std::string_view isa = setting("LIGHTSHAFT_TEST_ISA");
  std::string text = config ? config : "";
  if (!isa.empty()) text += "," + std::string("isa=").append(isa) + "," + std::string("max_isa=").append(isa);
  return real(text.c_str());  // of two equal settings the later one is used
}

// The layout of RTCRayHit up to the primitive's number, after 12 numbers of the ray and 5 of the hit. The ray
// is Embree 3's third argument and Embree 4's second.
extern "C" void rtcIntersect1(void* scene, void* second, void* third) {
  static const auto real = library<void(void*, void*, void*)>("rtcIntersect1");
  static const bool off = setting("LIGHTSHAFT_TEST_OFF") == "rtcIntersect1";
  static const bool embree3 = dlsym(RTLD_NEXT, "rtcIntersect1M") != nullptr;  // not in 4
  real(scene, second, third);
  void* ray = embree3 ? third : second;
  constexpr int kPrimitive = 17;
  unsigned& primitive = static_cast<unsigned*>(ray)[kPrimitive];
  if (off && primitive == 1) primitive = 0;
}
