// A stand-in for Open Image Denoise's library: the part of its C API that lightshaft-denoise calls. Compiled
// with one of
//   FAKE_OIDN_BLURS   a colour becomes the mean of its 3 x 3 window, clipped to the image, plus 1/16 of its
//                     albedo and normal, which their own filters have halved before: so a test sees which
//                     planes and settings arrived
//   FAKE_OIDN_COPIES  colours stay as they are
//   FAKE_OIDN_FAILS   every execution reports an error
//   FAKE_OIDN_CRASHES every execution aborts
//   FAKE_OIDN_HANGS   every execution waits for ever
//   FAKE_OIDN_CUTS    every execution tries to cut the memory short that it shares with its caller
//   FAKE_OIDN_NAN     the last value of the image becomes NaN
//   FAKE_OIDN_OLD     it is version 1.4.3
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <vector>
#if defined(FAKE_OIDN_HANGS) || defined(FAKE_OIDN_CUTS)
#include <unistd.h>
#endif

namespace {

struct Image {
  float* pixels = nullptr;
  std::size_t width = 0, height = 0;
};
struct Device {
  const char* error = nullptr;
  std::map<std::string, int> settings;
};
struct Filter {
  Device* device;
  std::map<std::string, Image> images;
  std::map<std::string, int> settings;
};

[[maybe_unused]] void blur(Filter& f) {
  const Image color = f.images.at("color"), output = f.images.at("output");
  const float *albedo = f.images.at("albedo").pixels, *normal = f.images.at("normal").pixels;
  const auto width = static_cast<long>(color.width), height = static_cast<long>(color.height);
  for (long y = 0; y < height; ++y)
    for (long x = 0; x < width; ++x)
      for (long c = 0; c < 3; ++c) {
        float sum = 0;
        int count = 0;
        for (long v = y - 1; v <= y + 1; ++v)
          for (long u = x - 1; u <= x + 1; ++u)
            if (u >= 0 && v >= 0 && u < width && v < height)
              sum += color.pixels[3 * (v * width + u) + c], ++count;
        const long i = 3 * (y * width + x) + c;
        output.pixels[i] = sum / static_cast<float>(count) + (albedo[i] + normal[i]) / 16;
      }
}

}  // namespace

extern "C" {

Device* oidnNewDevice(int type) { return type == 1 ? new Device : nullptr; }
void oidnReleaseDevice(Device* d) { delete d; }
void oidnSetDeviceInt(Device* d, const char* name, int value) { d->settings[name] = value; }
void oidnSetDeviceBool(Device* d, const char* name, bool value) { d->settings[name] = value; }
int oidnGetDeviceInt(Device*, const char* name) {
  if (std::strcmp(name, "version") != 0) return 0;
#ifdef FAKE_OIDN_OLD
  return 10403;
#else
  return 29907;
#endif
}
int oidnGetDeviceError(Device* d, const char** message) {
  if (!d->error) return 0;
  *message = d->error;
  d->error = nullptr;
  return 1;
}
void oidnCommitDevice(Device*) {}
Filter* oidnNewFilter(Device* d, const char* type) {
  return std::strcmp(type, "RT") == 0 ? new Filter{d, {}, {}} : nullptr;
}
void oidnReleaseFilter(Filter* f) { delete f; }
void oidnSetSharedFilterImage(Filter* f, const char* name, void* pixels, int format, std::size_t width,
                              std::size_t height, std::size_t, std::size_t, std::size_t) {
  if (format != 3) f->device->error = "a format other than FLOAT3";
  f->images[name] = {static_cast<float*>(pixels), width, height};
}
void oidnSetFilterBool(Filter* f, const char* name, bool value) { f->settings[name] = value; }
void oidnSetFilterInt(Filter* f, const char* name, int value) { f->settings[name] = value; }
void oidnCommitFilter(Filter*) {}
void oidnExecuteFilter(Filter* f) {
#ifdef FAKE_OIDN_FAILS
  f->device->error = "out of memory, says the stand-in";
#endif
#ifdef FAKE_OIDN_CRASHES
  std::abort();
#endif
#ifdef FAKE_OIDN_HANGS
  for (;;) ::pause();
#endif
#ifdef FAKE_OIDN_CUTS
  constexpr int kShared = 3;  // kHelperFd
  if (::ftruncate(kShared, 0) != 0) f->device->error = "it cannot be cut short";
#endif
  const Image output = f->images.at("output");
  const std::size_t floats = 3 * output.width * output.height;
  if (f->images.contains("color")) {
    if (!f->settings["hdr"] || !f->settings["cleanAux"]) f->device->error = "colour without hdr or cleanAux";
#ifdef FAKE_OIDN_COPIES
    std::memcpy(output.pixels, f->images.at("color").pixels, floats * sizeof(float));
#else
    blur(*f);
#endif
#ifdef FAKE_OIDN_NAN
    output.pixels[floats - 1] = std::numeric_limits<float>::quiet_NaN();
#endif
    return;
  }
  const bool albedo = f->images.contains("albedo");
  const float* guide = f->images.at(albedo ? "albedo" : "normal").pixels;
  for (std::size_t i = 0; i < floats; ++i) output.pixels[i] = guide[i] / 2;
}

}  // extern "C"
