// lightshaft-denoise LIBRARY THREADS SECONDS: denoises the images in the inherited file kHelperFd
// (exchange.h) with Intel Open Image Denoise 2 and exits; after SECONDS it is killed by SIGALRM. LIBRARY is
// passed to dlopen(). Since the library is found at run time, it is not needed to build: the functions of its
// C API are declared here according to its documentation
// (https://www.openimagedenoise.org/documentation.html).
#include <dlfcn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "core/base/helper_program.h"
#include "core/base/spawn.h"
#include "util/denoise/exchange.h"

namespace {

using ls::denoise::Header;
using ls::denoise::Outcome;

// Limit of the library's own memory, in MB; the library denoises images that need more in parts.
constexpr int kMaxMemoryMegabytes = 2048;

// Limits this process: it is killed when its parent ends, or after `most_seconds` of wall-clock time. (A
// limit of CPU time is not enough: deadlocked threads of the library use none.)
void confine(unsigned most_seconds) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  ::alarm(most_seconds);
}

void set_error(Header& header, const char* what, const char* why) {
  if (header.error[0]) return;  // the first error is kept, since it is the cause
  std::snprintf(header.error, sizeof header.error, "%s: %s", what, why ? why : "no reason given");
}

// The functions of Open Image Denoise, loaded by dlopen(). If one is missing, ok() is false.
class Library {
 public:
  Library(const char* path, Header& header)
      : header_(header), library_(::dlopen(path, RTLD_NOW | RTLD_LOCAL)) {
    if (!library_) {
      set_error(header_, path, ::dlerror());
      return;
    }
    ok_ = find(new_device, "oidnNewDevice") && find(release_device, "oidnReleaseDevice") &&
          find(set_device_int, "oidnSetDeviceInt") && find(set_device_bool, "oidnSetDeviceBool") &&
          find(device_int, "oidnGetDeviceInt") && find(device_error, "oidnGetDeviceError") &&
          find(commit_device, "oidnCommitDevice") && find(new_filter, "oidnNewFilter") &&
          find(release_filter, "oidnReleaseFilter") && find(set_image, "oidnSetSharedFilterImage") &&
          find(set_filter_bool, "oidnSetFilterBool") && find(set_filter_int, "oidnSetFilterInt") &&
          find(commit_filter, "oidnCommitFilter") && find(execute_filter, "oidnExecuteFilter");
  }
  bool ok() const { return ok_; }

  using Device = struct DeviceImpl*;
  using Filter = struct FilterImpl*;
  static constexpr int kCpu = 1, kFloat3 = 3;

  Device (*new_device)(int type) = nullptr;
  void (*release_device)(Device) = nullptr;
  void (*set_device_int)(Device, const char*, int) = nullptr;
  void (*set_device_bool)(Device, const char*, bool) = nullptr;
  int (*device_int)(Device, const char*) = nullptr;
  int (*device_error)(Device, const char** message) = nullptr;
  void (*commit_device)(Device) = nullptr;
  Filter (*new_filter)(Device, const char* type) = nullptr;
  void (*release_filter)(Filter) = nullptr;
  void (*set_image)(Filter, const char* name, void* pixels, int format, std::size_t width, std::size_t height,
                    std::size_t byte_offset, std::size_t pixel_stride, std::size_t row_stride) = nullptr;
  void (*set_filter_bool)(Filter, const char*, bool) = nullptr;
  void (*set_filter_int)(Filter, const char*, int) = nullptr;
  void (*commit_filter)(Filter) = nullptr;
  void (*execute_filter)(Filter) = nullptr;

 private:
  template <class F>
  bool find(F& function, const char* name) {
    function = reinterpret_cast<F>(::dlsym(library_, name));
    if (!function)
      set_error(header_, name, "this library of Open Image Denoise lacks the function; version 2 has it");
    return function != nullptr;
  }
  Header& header_;
  void* library_;  // never closed, since its threads may still run when main() returns
  bool ok_ = false;
};

class Run {
 public:
  Run(const Library& oidn, Header& header, int threads) : oidn_(oidn), header_(header) {
    device_ = oidn.new_device(Library::kCpu);
    if (!device_ || failed("a device for this processor")) return;
    oidn.set_device_int(device_, "numThreads", threads);
    oidn.set_device_bool(device_, "setAffinity", false);
    oidn.commit_device(device_);
    if (failed("a device for this processor")) return;
    header.version = oidn.device_int(device_, "version");
    ready_ = header.version >= 20000;
    if (!ready_) set_error(header, "Open Image Denoise", "version 2 is needed");
  }
  ~Run() {
    if (device_) oidn_.release_device(device_);
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  // Denoises one image; the result replaces `color`. The guides (albedo and normal) are denoised first, each
  // by a filter of its own, so that the filter of the colour may treat them as free of noise.
  bool denoise(float* color, float* albedo, float* normal) {
    if (!ready_) return false;
    const std::size_t floats = ls::denoise::plane_floats(header_.width, header_.height);
    std::vector<float> clean_albedo(floats), clean_normal(floats), result(floats);
    if (!execute({{"albedo", albedo}, {"output", clean_albedo.data()}}, false) ||
        !execute({{"normal", normal}, {"output", clean_normal.data()}}, false) ||
        !execute({{"color", color},
                  {"albedo", clean_albedo.data()},
                  {"normal", clean_normal.data()},
                  {"output", result.data()}},
                 true))
      return false;
    std::copy(result.begin(), result.end(), color);
    return true;
  }

 private:
  struct Image {
    const char* name;
    float* pixels;
  };
  bool failed(const char* what) {
    const char* message = nullptr;
    if (oidn_.device_error(device_, &message) == 0) return false;
    set_error(header_, what, message);
    return true;
  }
  bool execute(std::initializer_list<Image> images, bool color) {
    const Library::Filter filter = oidn_.new_filter(device_, "RT");
    if (!filter) {
      failed("a filter");
      return false;
    }
    for (const Image& i : images)
      oidn_.set_image(filter, i.name, i.pixels, Library::kFloat3, static_cast<std::size_t>(header_.width),
                      static_cast<std::size_t>(header_.height), 0, 0, 0);
    oidn_.set_filter_bool(filter, "hdr", color);
    oidn_.set_filter_bool(filter, "cleanAux", color);
    oidn_.set_filter_int(filter, "maxMemoryMB", kMaxMemoryMegabytes);
    oidn_.commit_filter(filter);
    oidn_.execute_filter(filter);
    oidn_.release_filter(filter);
    return !failed("denoising");
  }

  const Library& oidn_;
  Header& header_;
  Library::Device device_ = nullptr;
  bool ready_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return ls::answer_person("lightshaft-denoise", LIGHTSHAFT_VERSION, argc, argv);
  confine(static_cast<unsigned>(std::max(1, std::atoi(argv[3]))));
  struct stat file {};
  if (::fstat(ls::kHelperFd, &file) != 0) return 3;
  const auto bytes = static_cast<std::size_t>(file.st_size);
  void* mapped = bytes < ls::denoise::kPlanesAt
                     ? MAP_FAILED
                     : ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, ls::kHelperFd, 0);
  if (mapped == MAP_FAILED) return 3;
  Header& header = *static_cast<Header*>(mapped);
  if (header.magic != ls::denoise::kMagic ||
      bytes != ls::denoise::shared_bytes(header.width, header.height, header.images))
    return 3;
  const Library oidn(argv[1], header);
  bool done = oidn.ok();
  if (done) {
    Run run(oidn, header, std::max(1, std::atoi(argv[2])));
    done = header.error[0] == 0;
    auto* planes = reinterpret_cast<float*>(static_cast<std::byte*>(mapped) + ls::denoise::kPlanesAt);
    const std::size_t plane = ls::denoise::plane_floats(header.width, header.height);
    for (int i = 0; done && i < header.images; ++i, planes += ls::denoise::kPlanesPerImage * plane)
      done = run.denoise(planes, planes + plane, planes + 2 * plane);
  }
  header.outcome = done ? Outcome::done : Outcome::failed;
  std::_Exit(0);  // skips the destructors of the library, which may wait for its threads
}
