// Denoises images with Intel Open Image Denoise (https://www.openimagedenoise.org), version 2. The library is
// optional and is searched for at run time. It runs in a separate program, lightshaft-denoise, installed
// beside the executable: a crash or a lack of memory in it is only an error for the caller.
//
// If the environment variable LIGHTSHAFT_OIDN is set, it names the library: its file, its folder, or the
// folder above that. Otherwise the library is searched for in this order: `oidn/lib` beside the executable;
// `oidn/lib` two folders above the executable, where deploy/install-denoiser.sh puts it in a build; the
// places where the system's loader looks.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/spawn.h"
#include "core/image/frame/frame.h"

namespace ls {

// An image with its guides. All have three values per pixel, row by row.
struct NoisyImage {
  std::vector<float> color;   // linear, finite; negative values count as 0
  std::vector<float> albedo;  // in [0, 1]
  std::vector<float> normal;  // components in [-1, 1]
};

class Denoiser {
 public:
  // Finds the library and reads its version. `library` is the path of the library; if it is empty, the
  // library is searched for as described above. `threads` is the number of threads for denoising. `program`
  // is the path of lightshaft-denoise. `least_seconds` is the time limit of denoise() for small images; the
  // limit grows with the number of pixels. failed_precondition: the library cannot be used on this machine;
  // the message contains the reason and how to install it. resource_exhausted: the library hung, or there was
  // not enough memory.
  static Result<Denoiser> find(int threads, const std::string& library = {},
                               const std::filesystem::path& program = program_beside_us("lightshaft-denoise"),
                               int least_seconds = 600);

  const std::string& name() const { return name_; }  // for example "Open Image Denoise 2.5.1"

  // Returns the denoised colours of each image; all values are finite. `size` is the size of every image.
  // resource_exhausted: there was not enough memory, or the library hung; internal: the library failed.
  Result<std::vector<std::vector<float>>> denoise(FrameSize size, std::span<const NoisyImage> images) const;

 private:
  // Returns the time limit for denoising, in seconds: far more than denoising takes even on one busy core,
  // where an image of 10^6 pixels needs a few seconds.
  int most_seconds(FrameSize size, std::size_t images) const;

  std::filesystem::path program_;
  std::string library_, name_;
  int threads_ = 1, least_seconds_ = 0;
};

}  // namespace ls
